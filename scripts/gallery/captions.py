"""The text of the gallery's page: what each scene shows and where it fails."""

from __future__ import annotations

INTRODUCTION = """# Gallery
Scenes that show what the maps preserve and where they fail. `make gallery` builds, bakes, fits, measures and draws all of it and writes
this page. It resumes after any interruption. That run measured every figure below.

In a strip, each row shows one held-out light under one exposure, with its direction beside it on the hemisphere seen from above.
The number under a relit image is its PSNR against the image beside it on the left; the tables have the mean over all held-out lights.
*25 maps* are the article's method at 200 bytes per texel, *best of 16 bytes* is `srbf fit --method auto --budget 16`. *+ rays*: baked with
`--transport indirect`, with the direct light added as by `srbf relight --direct ray`. Clips are relit from assets alone. They are lossy
WebP and measure nothing.

## Error by bytes
![Held-out PSNR against bytes per texel, one panel per scene]({folder}/{figure})

Curves: methods fitted to the same 4096 random texels under combined light and tested there on the held-out lights, as in `srbf report`.
Red: the assets of this page, on all texels; stars use ray-traced direct light. Clusters fit a few texels better than the many
of a whole image, most on glossy scenes. Dashed and dotted: all captured images interpolated, and the nearest one, at the bytes of
all images."""

TITLES = {
    "caustics": "Caustics and colored shadows",
    "house": "A lantern carried through a room at night",
    "colored_room": "Glossy objects in a colored room",
    "lattice": "Shadows of laths and leaves",
    "coin": "A coin under a light dome",
    "still_life": "Vases and a ring in one atlas",
}

CAPTIONS = {
    "caustics": """
The lightmap of a table under two glass rings, a ball and an angel of tinted glass, beside an opaque pawn: light converges, and shadows have
colors. The glass is an approximation, a transmittance by angle. The sun is as wide as the mean light spacing.

Where it fails: 25 maps blur every shape to their own width and smear the long shadows of a low sun. Clusters keep the shapes at a small
part of the bytes, but fray at their borders: dark, ragged rims, and the pawn's long shadow in shreds.
""",
    "house": """
A dim room baked without the sun's direct light. The clip's lantern was never captured. Its direct light and its shadows are ray traced,
25 maps add the bounces in the room, and a bluish moon stays fixed. (The lantern's flame is painted.)

Where it fails: maps of combined light do not work, 25 of them lose the shadow of every bar and rafter. 16 components score as well as 25
maps and look worse: shade turns into brown fog or grain, because a few glossy sparks take their range. And a capture under directional
lights can only approximate the bounces of a light inside: its shade stays too dark. The error is given below.
""",
    "colored_room": """
A stage between a red and a green wall, with steel, copper, gold, glaze and lacquer, under a sun as wide as the mean light spacing. Color
bleeding is preserved: red and green on floor and block, and soft shadows about where they belong.

Where it fails: a highlight is narrower than a map's Gaussian, and brighter than everything else. 25 maps turn the sun's reflection into
zebra stripes, clusters into confetti, and both leave stains in the deepest shade. The clip shows both, under a warm sun and a blue one that
turns in the opposite direction.
""",
    "lattice": """
A terrace under a vine: leaves and laths cast hard shadows, finer than the spacing of the captured lights. With ray-traced direct light,
through leaves as well, 16 bytes per texel hold the rest.

Where it fails: with the shadows in the maps nothing works. Both 25 maps and the best of 16 bytes show stains that appear and vanish in the
places of the shadows. And 16 components share their colors: a blue bench turns green in the shade.
""",
    "coin": """
A relightable photograph: a coin under a light dome, delivered as a photographer would, as 8-bit JPEGs and a light list, and
imported by `srbf import --lp dirs.lp --holdout-lp test.lp --transfer srgb`. No photograph had the clip's raking light.

Where it fails: 25 maps lighten the shadows behind face and letters, lose the coin's own shadow on the felt, and leave dark blotches. The
best of 16 bytes comes within a decibel of all photographs interpolated;
its shadows have grainy edges where the dome's lights are too far apart.
""",
    "still_life": """
Seven objects in one lightmap: spheres scaled along three axes, a scaled cube under them, a mirrored jar, a bowl sheared by its parent and a
ring; smooth and flat shading. No scale is applied. Rays add the direct light, 16 components the bounces between the objects.

Where it fails: maps of combined light blur the shadows that the objects cast on the table and on each other, or break them into grain, and
16 components turn the colors of the bounces in the shade gray.
""",
}
