"""The command line of the films: python -m dollop.replication.films [name ...]."""

from dollop.cli import in_one_line
from dollop.replication.films import main

if __name__ == "__main__":
    in_one_line("films", main)
