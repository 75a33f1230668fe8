"""Draw the README's figure: python tools/readme_figure.py docs/lever.png"""

import sys

from PIL import Image

from hotlever import Lever, Probe, save_figure
from hotlever.figures import field_maps

lever = Lever(Probe.reference())
(state,) = lever.solve(lever.knee().bias_V.values)
save_figure(field_maps(state), sys.argv[1])
# small enough for a repository
Image.open(sys.argv[1]).convert("RGB").resize((550, 534), Image.Resampling.LANCZOS).save(
    sys.argv[1], optimize=True
)
