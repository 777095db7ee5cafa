"""Every numbered figure of the paper, regenerated: python -m dollop.figures [id ...]."""

from dollop.cli import in_one_line, replication

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
    in_one_line("figures", lambda: replication("figures").main(arguments))


if __name__ == "__main__":
    main()
