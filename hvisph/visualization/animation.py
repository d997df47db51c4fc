"""Animations of a run as GIF, or as MP4 with ffmpeg."""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from hvisph.core.errors import CaseError, suggest_nearest
from hvisph.output.atomic_write import replacing

from .particles import Look, Moment, _project, draw, extent_of, scale_of

FORMATS = (".gif", ".mp4")


def animate(moments: Sequence[Moment], path: str | os.PathLike[str], look: Look, seconds: float = 6.0) -> Path:
    """Draw every moment on one scale and store them as one moving picture.

    Parameters
    ----------
    moments
        In order of time.
    path
        File to write: ``.gif`` or ``.mp4``.
    look
        How particles are shown.
    seconds
        How long it lasts.

    Raises
    ------
    CaseError
        When the ending is unknown, or ffmpeg is not there for an MP4.
    """
    target = Path(path)
    if target.suffix.lower() not in FORMATS:
        raise CaseError(
            f"{target}: an animation is no '{target.suffix}'{suggest_nearest(target.suffix, FORMATS)}", where="-o"
        )
    if target.suffix.lower() == ".mp4" and shutil.which("ffmpeg") is None:
        raise CaseError("an MP4 needs ffmpeg, which is not installed; write a .gif", where="-o")
    ends = scale_of(moments, look)
    extent = extent_of([_project(moment, look) for moment in moments], moments, look)
    pictures = [_draw_frame(moment, look, ends, extent) for moment in moments]
    pace = max(seconds / len(pictures), 0.04)
    if target.suffix.lower() == ".gif":
        images = [picture.quantize(128) for picture in pictures]
        with replacing(target) as file:
            images[0].save(file, format="GIF", save_all=True, append_images=images[1:], loop=0,
                           duration=[int(1000 * pace)] * (len(images) - 1) + [1500])  # fmt: skip
        return target
    return _film(pictures, target, pace)


def _draw_frame(moment: Moment, look: Look, ends: tuple[float, float], extent: Any) -> Any:
    from PIL import Image

    figure = draw([moment], look, ends, extent)
    figure.set_dpi(90)
    data = BytesIO()
    figure.savefig(data, format="png", dpi=90)
    return Image.open(data).convert("RGB")


def _film(pictures: Sequence[Any], target: Path, pace: float) -> Path:
    import subprocess

    width, height = (size - size % 2 for size in pictures[0].size)
    rate = f"{1.0 / pace:.4g}"
    partial = target.with_name(f"{target.stem}.partial.mp4")
    command = ["ffmpeg", "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}",
               "-r", rate, "-i", "-", "-pix_fmt", "yuv420p", str(partial)]  # fmt: skip
    frames = b"".join(np.asarray(picture.crop((0, 0, width, height))).tobytes() for picture in pictures)
    done = subprocess.run(command, input=frames, capture_output=True, check=False)  # noqa: S603 a fixed command
    if done.returncode:
        partial.unlink(missing_ok=True)
        raise CaseError(f"ffmpeg could not write {target}: {done.stderr.decode(errors='replace')[:300]}", where="-o")
    os.replace(partial, target)
    return target
