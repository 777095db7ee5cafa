"""How far a track is from the truth that the laboratory kept.

The truth serves this purpose only.
"""

import numpy as np

__all__ = ["track_error"]


def track_error(track, truth, sensor):
    """Distance between a track and the true walker, with the constant near-side bias taken out.

    The laser sees only the near half of a body, so every centroid lies before the body's middle.
    The bias is the mean error along the line of sight; the error is what is left when each position
    is pushed away from the sensor by it. The paper tells no error; this measure of one is ours.

    Parameters
    ----------
    track : Track
        The user.
    truth : pandas.DataFrame
        Columns t in s, x, y in m: the true walker.
    sensor : (2,) array_like
        Where the laser stood, in m.

    Returns
    -------
    bias : float
        Metres towards the sensor.
    errors : (N,) float array
        Metres, one for each time of the track.

    Examples
    --------
    A track that is always 0.1 m too near has a bias, and no error.

    >>> from types import SimpleNamespace
    >>> import pandas as pd
    >>> truth = pd.DataFrame({"t": [0.0, 1.0], "x": [2.0, 4.0], "y": [0.0, 0.0]})
    >>> track = SimpleNamespace(t=truth.t, positions=np.array([(1.9, 0.0), (3.9, 0.0)]))
    >>> bias, errors = track_error(track, truth, sensor=(0.0, 0.0))
    >>> round(bias, 6), errors.round(6).tolist()
    (0.1, [0.0, 0.0])
    """
    true = np.column_stack([np.interp(track.t, truth.t, truth[axis]) for axis in "xy"])
    sight = true - np.asarray(sensor)[:2]
    sight /= np.linalg.norm(sight, axis=1, keepdims=True)
    missing = true - track.positions
    bias = float((missing * sight).sum(axis=1).mean())
    return bias, np.linalg.norm(missing - bias * sight, axis=1)
