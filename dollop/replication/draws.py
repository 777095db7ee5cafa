"""Drawing anew until there is room, and telling how often that was."""

__all__ = ["drawn_until_room"]

MOST = 100
"""Draws, after which there is no room."""


def drawn_until_room(draw, most=MOST):
    """The first draw for which there is room, and how many draws that took.

    Who draws anew chooses: what is found is of the draws with room alone. So their number belongs
    beside it.

    Parameters
    ----------
    draw : callable
        k -> anything, for the k-th draw from 0 on; a ValueError is no room.
    most : int
        Draws.

    Returns
    -------
    found : anything
        What the draw gave.
    count : int
        Draws that it took, from 1 on.

    Raises
    ------
    RuntimeError
        No room in so many draws.

    Examples
    --------
    >>> drawn_until_room(lambda k: int(["no room", "7"][k]))
    (7, 2)
    """
    for k in range(most):
        try:
            return draw(k), k + 1
        except ValueError:  # no room
            continue
    raise RuntimeError(f"a draw must find room, got none in {most} draws")
