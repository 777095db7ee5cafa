"""YAML without its surprises: nodes and their text; no anchors, aliases and tags, and not too many of them."""

from itertools import accumulate

import yaml

__all__ = ["plain_nodes"]

DEEPEST = 20
"""Brackets of a YAML within each other: of thousands PyYAML tries for minutes whether each begins a key."""


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
        For what is no YAML, has an anchor, an alias or a tag, brackets more than 20 deep within each
        other, or more nodes.
    """
    brackets = (1 if byte in b"[{" else -1 for byte in content if byte in b"[{]}")
    if max(accumulate(brackets, lambda depth, step: max(depth + step, 0)), default=0) > DEEPEST:
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
                raise ValueError(f"there must be no anchors, aliases and tags, got one on line {line}")
            if isinstance(event, yaml.NodeEvent | yaml.CollectionEndEvent):
                yield event
    except yaml.YAMLError as error:
        raise ValueError(f"not YAML: {error}") from None
