"""The user as a Continuous-Density Hidden Markov Model over subgoals (Sec. V)."""

from dollop.cdhmm.model import SubgoalHMM

__all__ = ["SubgoalHMM"]
