"""Reads a picture of Tessera with OpenEXR's own Python module and compares it with another one of the same scene.

usage: read.py OURS.exr OURS.manifest.json PEER.exr HIGHEST_RMSE
"""
import json
import math
import sys

import numpy
import OpenEXR


def linear(path):
    """Header and pixels as float64, height x width x RGB."""
    picture = OpenEXR.File(path)
    channels = picture.channels()
    pixels = channels["RGB"].pixels if "RGB" in channels else numpy.stack([channels[c].pixels for c in "RGB"], axis=-1)
    return picture.header(), numpy.asarray(pixels, dtype=numpy.float64)[..., :3]


def expect(holds, what):
    if not holds:
        sys.exit(f"read.py: {what}")


ours, manifest, peer, highest = sys.argv[1:]
header, pixels = linear(ours)
with open(manifest, encoding="utf-8") as file:
    image = json.load(file)["image"]

expect(pixels.shape == (image["height"], image["width"], 3), f"{ours} has the shape {pixels.shape}")
expect(numpy.isfinite(pixels).all() and (pixels >= 0).all(), f"{ours} has pixels that are negative or not finite")
expect(header["compression"] == OpenEXR.ZIP_COMPRESSION, f"{ours} is compressed by {header['compression']}")
expect(header["pixelAspectRatio"] == 1.0, f"{ours} has pixels of the aspect {header['pixelAspectRatio']}")
primaries = [0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290]
expect(numpy.allclose(header["chromaticities"], primaries, atol=1e-6), f"{ours} has the primaries {header['chromaticities']}")
identity = json.loads(header["tessera"])
expect(identity["image_hash"] == image["image_hash"], f"{ours} has the identity {identity}")
expect(identity["seed"] == image["seed"], f"{ours} has the seed {identity['seed']}")

_, reference = linear(peer)
difference = pixels - reference
rmse = math.sqrt((difference**2).mean())
differing = (numpy.abs(difference).max(axis=-1) > 1 / 255).sum()
print(f"RMSE against {peer}: {rmse:.2e} (at most {float(highest):.0e}); {differing} of {image['width'] * image['height']} pixels differ by more than 1/255")
expect(rmse <= float(highest), "the pictures differ")
