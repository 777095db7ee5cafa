"""python -m dollop: the command line."""

from dollop.cli import main

if __name__ == "__main__":
    main()
