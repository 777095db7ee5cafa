"""Every numbered figure of the paper, regenerated: python -m dollop.figures [id ...]."""

from dollop.replication.figures import main

if __name__ == "__main__":
    main()
