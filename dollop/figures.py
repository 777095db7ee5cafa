"""Every numbered figure of the paper, regenerated: python -m dollop.figures [id ...]."""

import sys

from dollop.cli import replication

__all__ = ["main"]


def main(arguments=None):
    """Draw the figures named by id, or all, into figures/.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the shell by default.

    Raises
    ------
    SystemExit
        With a message for what is refused.
    """
    try:
        replication("figures").main(arguments)
    except ImportError as error:
        sys.exit(f"figures: {error}")


if __name__ == "__main__":
    main()
