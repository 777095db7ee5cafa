"""Pictures one after the other as a file: MP4 that browsers play, or an animated GIF."""

import tempfile
from io import BytesIO
from itertools import pairwise
from pathlib import Path

import numpy as np
from PIL import Image

__all__ = ["encoded", "gif", "mp4", "need_av"]

QUALITY = "26"
"""Constant rate factor of x264: lower is finer and larger."""

SAME, FEW, VIVID = 255, 63, 70
"""Of the colours of an animated GIF: which stands for what stays as it was in the frame before; how many
are kept for what is vivid; and what is: the difference of its largest and least of red, green and blue."""


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
    palette = palette_of(frames[:: max(1, len(frames) // 4)])
    shown = [np.asarray(frame.quantize(palette=palette, dither=0)) for frame in frames]
    new = [shown[0], *(np.where(each == last, SAME, each) for last, each in pairwise(shown))]
    pictures = [Image.fromarray(each.astype(np.uint8)) for each in new]
    for each in pictures:
        each.putpalette(palette.getpalette())
    told = {"duration": 10 * round(100 / rate), "loop": 0, "transparency": SAME}
    stream = BytesIO()
    look = {"format": "GIF", "save_all": True, "optimize": False, "disposal": 1}
    pictures[0].save(stream, append_images=pictures[1:], **look, **told)
    return stream.getvalue()


def palette_of(frames):
    """A picture whose palette has the colours of some frames: most for all, the rest for the vivid alone.

    Of a room that is nearly all grey the usual choice would lose the robot's red.
    """
    pixels = np.concatenate([np.asarray(frame).reshape(-1, 3) for frame in frames])
    vivid = pixels[np.ptp(pixels.astype(int), axis=1) > VIVID]
    colours = np.full((256, 3), 255, np.uint8)
    for part, begin, end in ((pixels, 0, SAME - FEW), (vivid, SAME - FEW, SAME)):
        if len(part):
            found = Image.fromarray(part[None]).quantize(end - begin, Image.Quantize.MEDIANCUT)
            chosen = np.reshape(found.getpalette(), (-1, 3))[: end - begin]
            colours[begin : begin + len(chosen)] = chosen
    picture = Image.new("P", (1, 1))
    picture.putpalette(colours[:SAME].ravel().tolist())
    return picture
