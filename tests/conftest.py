"""What all tests share: the same examples on every machine, and names without file content."""

from hypothesis import settings

# `pytest --hypothesis-profile=default` draws new examples every time: do that before a release, not in CI.
settings.register_profile("repeatable", derandomize=True)
settings.load_profile("repeatable")


def pytest_make_parametrize_id(val, argname):
    """Name bytes after their argument: file content holds what changes, such as the time in a gzip's header."""
    return argname if isinstance(val, bytes) else None
