"""Pictures one after the other as a file: MP4 that browsers play, or an animated GIF."""

import tempfile
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image

__all__ = ["encoded", "gif", "mp4", "need_av"]

QUALITY = "26"
"""Constant rate factor of x264: lower is finer and larger."""

COLOURS = 255
"""Of an animated GIF: one of 256 is left for what stays as it was in the frame before."""


def need_av():
    """Refuse to begin where PyAV is missing, with the line that installs it.

    Raises
    ------
    ImportError
        If it is not installed.
    """
    try:
        import av  # noqa: F401
    except ImportError:
        raise ImportError('films need PyAV: pip install "dollop[films]"') from None


def encoded(frames, suffix, rate):
    """A film as the bytes of a file.

    Parameters
    ----------
    frames : iterable of PIL.Image.Image
        One at least, all of one size.
    suffix : {".mp4", ".gif"}
    rate : float
        Frames per second.

    Returns
    -------
    bytes
    """
    return {".mp4": mp4, ".gif": gif}[suffix](frames, rate)


def mp4(frames, rate):
    """A film as H.264, as all browsers play it: width and height must be even.

    Parameters
    ----------
    frames : iterable of PIL.Image.Image
    rate : int
        Frames per second.

    Returns
    -------
    bytes
        The same for the same frames, on one machine: a single thread encodes them.
    """
    import av

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"  # what stands first is written last, into the same file
        with av.open(str(path), "w", options={"movflags": "+faststart"}) as container:
            look = {"crf": QUALITY, "preset": "slow"}
            stream = container.add_stream("libx264", rate=rate, options=look)
            stream.pix_fmt, stream.thread_count = "yuv420p", 1
            for number, frame in enumerate(frames):
                if number == 0:
                    stream.width, stream.height = frame.size
                container.mux(stream.encode(av.VideoFrame.from_image(frame)))
            container.mux(stream.encode())
        return path.read_bytes()


def gif(frames, rate):
    """A film as an animated GIF that begins anew at its end.

    Parameters
    ----------
    frames : iterable of PIL.Image.Image
    rate : float
        Frames per second; each is shown for a whole number of hundredths of a second.

    Returns
    -------
    bytes
    """
    frames = list(frames)
    some = np.concatenate([np.asarray(frame) for frame in frames[:: max(1, len(frames) // 4)]])
    palette = Image.fromarray(some).quantize(COLOURS, Image.Quantize.MEDIANCUT, dither=0)
    frames = [frame.quantize(palette=palette, dither=0) for frame in frames]
    told = {"duration": 10 * round(100 / rate), "loop": 0, "optimize": False, "disposal": 1}
    stream = BytesIO()
    frames[0].save(stream, format="GIF", save_all=True, append_images=frames[1:], **told)
    return stream.getvalue()
