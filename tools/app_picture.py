"""Draw docs/app.png, the README's picture of the app, after its looks have changed.

PYTHONPATH=benchmarks python tools/app_picture.py
"""

import io
import tempfile
from pathlib import Path

from PIL import Image, ImageOps

from app_in_browser import browsing, running

TARGET = Path(__file__).parents[1] / "docs" / "app.png"
#: Of each colour: few enough for a file below 100 kB, and for a map of temperatures without steps.
BITS = 6

if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as top:
        folder = Path(top, "my-levers")
        with running(folder) as app, browsing(app) as (page, _):
            page.goto(f"{app.base}/simulate")
            page.get_by_text("full lever:").wait_for(timeout=180_000)
            # the path of a temporary folder says nothing
            label = page.get_by_text(str(folder), exact=True)
            label.evaluate("label => { label.textContent = 'my-levers' }")
            page.wait_for_timeout(3000)
            taken = page.screenshot()
    picture = Image.open(io.BytesIO(taken)).convert("RGB")
    ImageOps.posterize(picture, BITS).save(TARGET, optimize=True)
    print(f"{TARGET}: {TARGET.stat().st_size / 1000:.0f} kB")
