"""What all tests share: the same examples on every machine, however slow, and names without file content."""

from hypothesis import settings

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.register_profile("fresh", deadline=None)  # pytest --hypothesis-profile=fresh: new examples every time
settings.load_profile("repeatable")


def pytest_make_parametrize_id(val, argname):
    """Name bytes after their argument: file content holds what changes, such as the time in a gzip's header."""
    return argname if isinstance(val, bytes) else None
