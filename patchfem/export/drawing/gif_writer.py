"""matplotlib writer for .gif files in which a colour is the same in every frame."""

from io import BytesIO

import numpy as np
from matplotlib import colormaps
from matplotlib.animation import AbstractMovieWriter
from matplotlib.colors import to_rgb
from PIL import Image

from .pictures import BLUE, ORANGE

N_SCALE = 184  # number of colours for stresses; together with greys and tints 256
N_GREYS = 40  # number of greys from black to white, for the smooth edges of text and lines
N_TINTS = 16  # number of tints per curve, from white to its full colour


class GifWriter(AbstractMovieWriter):
    """Writer of an animated GIF whose frames share a palette of 256 colours.

    `matplotlib.animation.PillowWriter` chooses 256 colours for each frame, so that the same stress
    has another colour in the next frame.
    """

    def setup(self, fig, outfile, dpi=None):
        """Start the animation of a figure."""
        super().setup(fig, outfile, dpi=dpi)
        self.frames = []
        self.palette = Image.new("P", (1, 1))
        self.palette.putpalette(_make_palette().tobytes())

    def grab_frame(self, **savefig):
        """Add the current state of the figure as a frame."""
        buffer = BytesIO()
        self.fig.savefig(buffer, **savefig, format="rgba", dpi=self.dpi)
        image = Image.frombuffer(
            "RGBA", self.frame_size, buffer.getbuffer(), "raw", "RGBA", 0, 1
        ).convert("RGB")
        self.frames.append(image.quantize(palette=self.palette, dither=Image.Dither.NONE))

    def finish(self):
        """Write the animation to the file."""
        first, *others = self.frames
        duration = round(1000 / self.fps)
        first.save(
            self.outfile,
            save_all=True,
            append_images=others,
            duration=duration,
            loop=0,
            optimize=False,
        )


def _make_palette() -> np.ndarray:
    """Return the 256 colours of an animation: stress scale, greys and tints of the curves."""
    scale = colormaps["viridis"](np.linspace(0, 1, N_SCALE))[:, :3]
    greys = np.linspace(0, 1, N_GREYS)[:, None] * np.ones(3)
    fraction = np.linspace(0, 1, N_TINTS)[:, None]
    tints = [1 - fraction * (1 - np.array(to_rgb(colour))) for colour in (BLUE, ORANGE)]
    return np.round(255 * np.concatenate([scale, greys, *tints])).astype(np.uint8)
