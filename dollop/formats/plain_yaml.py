"""YAML without its surprises: its nodes as they stand there, within bounds, and nothing made of them."""

from itertools import accumulate

import yaml

__all__ = ["plain_nodes"]

DEEPEST = 20
"""Brackets within each other: of thousands PyYAML tries for minutes whether each begins a key."""


def plain_nodes(content, most):
    """The events of a YAML that make its nodes, as they come; no object is made of them.

    Parameters
    ----------
    content : bytes
    most : int
        Nodes.

    Yields
    ------
    yaml.Event
        Where a scalar, a sequence or a mapping begins, or one of these ends.

    Raises
    ------
    ValueError
        For what is no YAML, has an anchor, an alias or a tag, brackets more than 20 deep within
        each other, or more nodes.

    Examples
    --------
    >>> [node.value for node in plain_nodes(b"0x1F", 1)]
    ['0x1F']
    >>> next(plain_nodes(b"!!python/name:os.system", 1))
    Traceback (most recent call last):
    ValueError: there must be no anchors, aliases and tags, got one on line 1
    """
    brackets = (1 if byte in b"[{" else -1 for byte in content if byte in b"[{]}")
    # Never below zero: what is closed in a comment makes no room for what is opened after it.
    depths = accumulate(brackets, lambda depth, step: max(depth + step, 0), initial=0)
    if max(depths) > DEEPEST:
        raise ValueError(f"brackets must be at most {DEEPEST} deep within each other")
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    count = 0
    try:
        for event in yaml.parse(content, loader):
            count += isinstance(event, yaml.NodeEvent)
            if count > most:
                raise ValueError(f"holds more than {most} nodes, the most that is read")
            if getattr(event, "anchor", None) or getattr(event, "tag", None):
                line = event.start_mark.line + 1
                rule = "there must be no anchors, aliases and tags"
                raise ValueError(f"{rule}, got one on line {line}")
            if isinstance(event, yaml.NodeEvent | yaml.CollectionEndEvent):
                yield event
    except yaml.YAMLError as error:
        raise ValueError(f"not YAML: {error}") from None
