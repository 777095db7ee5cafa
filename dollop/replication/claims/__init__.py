"""The paper's testable claims, each beside its experiment: a pure function of a seed.

When a claim holds is told in `dollop.replication.claims.claim`.
"""

# ruff: noqa: F401  (to import a module is to register its claims)
from dollop.replication.claims import environment, foreground, law, learning, observing, premises, robot, structure
from dollop.replication.claims.claim import REGISTRY, Claim, Criterion

__all__ = ["CLAIMS", "Claim", "Criterion"]

SECTIONS = ("I", "II", "III", "IV-A", "IV-B", "V", "VI")
CLAIMS = dict(sorted(REGISTRY.items(), key=lambda item: SECTIONS.index(item[1].section)))
"""Every claim by its id, in the paper's order."""
