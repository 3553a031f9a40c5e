"""What the page says in words: what each scene shows and where it fails, as seen on its pictures."""

from __future__ import annotations

INTRODUCTION = """# Gallery
Scenes that show what the maps hold and where they fail. `make gallery` builds, bakes, fits, measures and draws all of it and writes
this page; stopped at any moment, it goes on where it was. Every figure below was measured by that run.

In a strip each row is one light that no fit has seen, under one exposure; its direction stands beside it on the sky seen from above.
The number under a relit picture is its PSNR against the one beside it on the left; the tables have the mean over all held-out lights.
*25 maps* are the article's method at 200 bytes a texel, *best of 16 bytes* is `srbf fit --method auto --budget 16`. *+ rays*: baked with
`--transport indirect`, the direct light added as by `srbf relight --direct ray`. Clips are relit from assets alone; they are lossy
WebP, and no measure of anything.

## What a byte buys
![Held-out PSNR against bytes a texel, a panel a scene]({folder}/{figure})

Curves: methods fitted to the same 4096 random texels under all light and asked there for the held-out lights, as `srbf report` does it.
Red: the assets of this page, on all texels; stars leave the direct light to rays. Clusters hold a few texels better than a whole
picture's many, most where things gloss. Dashed and dotted: all captured images interpolated, and the nearest one, at the bytes of keeping
every image."""

TITLES = {
    "caustics": "Caustics and colored shadows",
    "house": "A lantern carried through a room at night",
    "colored_room": "Glossy things in a colored room",
    "lattice": "Shadows of laths and leaves",
    "coin": "A coin under a dome of lamps",
    "still_life": "Vases and a ring in one atlas",
}

WORDS = {
    "caustics": """
A table's lightmap under two glass rings, a ball and an angel of tinted glass, beside an opaque pawn: light gathers, shadows have colors.
The glass is the scene's stand-in, a tint by angle; the sun is as wide as the captured lights stand apart.

Where it fails: 25 maps blur every shape to their own width and smear what a low sun draws out. Clusters keep the shapes at a small part of
the bytes, but fray where two of them meet: dark, ragged rims, and the pawn's long shadow in shreds.
""",
    "house": """
A dim room baked without the sun's direct light. The clip's lantern was never captured: its direct light and its shadows are its own, by
rays, 25 maps add what the room reflects, and a bluish moon stands still. (The lantern's flame is painted.)

Where it fails: all light in the maps does not work, 25 of them lose the shadow of every bar and rafter. 16 scalars score as well as 25
maps and look worse, shade turning into brown fog or grain, since a few glossy sparks take what they hold. And a capture under suns
outside can only guess where a lamp inside is reflected to: its shade stays too dark; how far off that is stands below.
""",
    "colored_room": """
A stage between a red and a green wall, with steel, copper, gold, glaze and lacquer on it, under a sun as wide as the captured lights stand
apart. What has met a wall bleeds and is held: red and green on floor and block, and soft shadows about where they belong.

Where it fails: a highlight is narrower than a map's Gaussian, and brighter than all else. 25 maps turn the reflection of the sun into
zebra stripes, clusters into confetti, and in the deepest shade both leave stains. The clip shows both, under a warm sun and a blue one that
goes the other way.
""",
    "lattice": """
A terrace under a vine: leaves and laths draw hard shadows, finer than the captured lights stand apart. With the direct light by rays,
through leaves as well, 16 bytes a texel hold what is left.

Where it fails: with the shadows in the maps nothing works, neither 25 maps nor the best of 16 bytes, which show stains that come and go
in the shadows' places. And 16 scalars share their colors: a blue bench turns green in the shade.
""",
    "coin": """
A relightable photograph: a coin of ours under a dome of lamps, delivered as a photographer would, as 8-bit JPEGs and a light list, and
imported by `srbf import --lp dirs.lp --holdout-lp test.lp --transfer srgb`. The clip's raking light was in no photograph.

Where it fails: 25 maps lighten the shadows behind face and letters, lose the coin's own on the felt, and leave dark blotches. The best of
16 bytes comes within a decibel of all photographs interpolated; its shadows have grainy edges where the lamps stand too far apart.
""",
    "still_life": """
Seven objects in one lightmap: spheres scaled along three axes, a scaled cube under them, a mirrored jar, a bowl sheared by its parent and a
ring; smooth and flat shading. No scale is applied. Rays add the direct light, 16 scalars what the objects reflect onto each other.

Where it fails: all light in the maps blurs the shadows that the objects cast on the table and on each other, or breaks them into grain, and
16 scalars turn the colors that the objects bounce into the shade gray.
""",
}
