"""`python benchmarks/sparse_gloss.py SCENE.blend… [--side 32] [--fit]`: sparse sampling of glossy transport beside brute force, one run.

Scenes are of `data/scenes/figure.py` with a ROUGHNESS. Per receiver and way of sampling: share of the elements, rays, CPU seconds; then the
L2 error (relative RMSE, receivers by the cosine of their viewer) of the radiance toward VIEWERS far viewers under six environment maps and
200 suns, at RECEIVERS of the vertices, against the whole BRDF by brute force: of sampling alone, and for each number of terms of the
factorization alone and with sampling. `--fit`: of an asset within 16 bytes, too.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np
from sparse import LOBES, lighting, prepared, traced

from srbf.brdf_factors import factored
from srbf.capture import COVERED
from srbf.cubemap_capture import CubemapCapture
from srbf.fitting.options import fit
from srbf.glossy_terms import GlossyTerms
from srbf.methods.glossy_eigen_map import GlossyEigenMap
from srbf.receiver_gloss import FactoredGloss
from srbf.sphere import random_directions

TERMS = (1, 2, 4, 8, 16)
ROUGHNESSES = (0.3, 0.5, 0.7, 0.85, 1.0)
VIEWERS, RECEIVERS = 6, 1024
WAYS = ("full", "neighbors")
STEP = 64  # receivers at a time


class Rows:
    """Some receivers of a capture, and the light that reaches them under every column of `lights` (N, M)."""

    def __init__(self, capture: CubemapCapture, lights: np.ndarray, viewers: np.ndarray) -> None:
        covered = np.flatnonzero(capture.coverage().ravel()[capture.receivers] >= COVERED)
        self.rows = np.sort(np.random.default_rng(5).permutation(covered)[:RECEIVERS])
        self._capture, self._lights, self._viewers = capture, lights, viewers
        self.cosines = np.maximum(capture.receiver_gloss.normals[self.rows] @ viewers.T, 0)  # (n, V)

    def exact(self) -> np.ndarray:
        """(V, n, M, 3) radiance by the whole BRDF."""
        directions, gloss = self._directions(), self._capture.receiver_gloss
        diffuse = self.diffuse()
        found = np.repeat(diffuse[None], len(self._viewers), axis=0)
        transport = self._capture._transport
        if transport.harmonics is not None:
            waves = transport.harmonics[:, self.rows]  # (K, n, r)
            mixed = np.einsum("rlc,lm->rmc", transport.weights, self._lights, optimize=True)
            for v, viewer in enumerate(self._viewers):
                toward = gloss.of_bounces(np.broadcast_to(viewer, gloss.normals.shape))[self.rows]  # (n, K, 3)
                found[v] += np.einsum("knr,nkc,rmc->nmc", waves, toward, mixed, optimize=True)
        for start in range(0, len(self.rows), STEP):
            own = self.rows[start : start + STEP]
            row, column = np.nonzero(self._seen(own))
            for v, viewer in enumerate(self._viewers):
                values = gloss.reflected(own[row], directions[column], np.broadcast_to(viewer, (len(row), 3)))
                for c in range(3):
                    matrix = np.zeros((len(own), len(directions)), np.float32)
                    matrix[row, column] = values[:, c]
                    found[v, start : start + len(own), :, c] += matrix @ self._lights
        return found

    def by_terms(self, terms: int) -> np.ndarray:
        """The same by an in-out factorization."""
        directions, gloss = self._directions(), self._capture.receiver_gloss
        factors = FactoredGloss.of(gloss, gloss.classes(), terms)
        lit = np.zeros((len(self.rows), terms, self._lights.shape[1]), np.float32)
        for start in range(0, len(self.rows), STEP):
            own = self.rows[start : start + STEP]
            row, column = np.nonzero(self._seen(own))
            matrix = np.zeros((terms, len(own), len(directions)), np.float32)
            matrix[:, row, column] = factors.of_lights(own[row], directions[column]).T
            lit[start : start + len(own)] = (matrix @ self._lights).transpose(1, 0, 2)
        transport = self._capture._transport
        if transport.harmonics is not None:
            mixed = transport.weights.mean(axis=2) @ self._lights  # (r, M)
            lit += np.einsum("knr,njk,rm->njm", transport.harmonics[:, self.rows], factors.of_bounces()[self.rows], mixed, optimize=True)
        found = np.repeat(self.diffuse()[None], len(self._viewers), axis=0)
        for v, viewer in enumerate(self._viewers):
            toward = factors.of_viewers(np.broadcast_to(viewer, gloss.normals.shape))[self.rows]  # (n, k, 3)
            found[v] += np.einsum("nkc,nkm->nmc", toward, lit, optimize=True)
        return np.maximum(found, 0)

    def of_asset(self) -> np.ndarray:
        """The same by an asset within 16 bytes."""
        began, capture = time.process_time(), self._capture
        asset = fit(capture, budget=16)
        print(
            f"  fitted in {time.process_time() - began:.0f} CPU s: {GlossyEigenMap.summary(asset)}, {asset.resident_bytes() / 1e6:.0f} MB"
        )
        texels = capture.receivers[self.rows]
        small = asset.at(texels)
        values = asset.light_functions.evaluate(self._directions()).astype(np.float32)  # (N, F G, 3)
        count = asset.clusters * (asset.components + 1)
        weights = np.einsum("nfc,nm->mfc", values.reshape(len(values), -1, 3), self._lights, optimize=True).reshape(
            -1, count, values.shape[1] // count, 3
        )
        terms = int(asset.manifest["gloss"]["terms"])
        white = np.repeat(weights[:, :, 1:].reshape(len(weights), count, -1)[:, :, :terms, None], 3, axis=3)
        every = np.concatenate([weights[:, :, :1], white], axis=2).reshape(len(weights), -1, 3)
        lit = np.stack([GlossyEigenMap.terms_of(small, one)[:, 0] for one in every], axis=2)  # (1 + k, n, M, 3)
        found = []
        for viewer in self._viewers:
            toward = GlossyEigenMap.viewer_factors(small, np.broadcast_to(viewer, (1, len(texels), 3)))[:, 0]  # (1 + k, n, 3)
            found.append(np.einsum("knc,knmc->nmc", toward, lit, optimize=True))
        return np.maximum(np.stack(found), 0)

    def errors(self, found: np.ndarray, true: np.ndarray) -> str:
        """Under the environments, and under the suns."""
        words = []
        for part in (slice(0, LOBES), slice(LOBES, None)):
            squares = [np.einsum("nv,vnmc->", self.cosines, np.square(values[:, :, part])) for values in (found - true, true)]
            words.append(f"{np.sqrt(squares[0] / squares[1]):.2%}")
        return " ".join(words)

    def diffuse(self) -> np.ndarray:
        """(n, M, 3) radiance of what is reflected diffusely."""
        gloss = self._capture.receiver_gloss
        split = GlossyTerms.of(self._capture, FactoredGloss.of(gloss, gloss.classes(), 1))
        texels, first = self._capture.receivers[self.rows], list(range(0, len(split.lights), split.groups))
        return np.concatenate(
            [
                np.einsum("nlc,lm->nmc", split.sample(first, texels[s : s + STEP]), self._lights, optimize=True)
                for s in range(0, len(texels), STEP)
            ]
        )

    def _directions(self) -> np.ndarray:
        return self._capture.directions(self._capture.indices("train"))

    def _seen(self, rows: np.ndarray) -> np.ndarray:
        transport = self._capture._transport
        return transport.cosines(rows, np.arange(transport.cubemap.count)) > 0


def seconds_of_terms(capture: CubemapCapture, terms: int) -> float:
    """CPU seconds of all T_i of all receivers and directions, which take no ray."""
    gloss = capture.receiver_gloss
    split = GlossyTerms.of(capture, FactoredGloss.of(gloss, gloss.classes(), terms))
    began = time.process_time()
    for _ in split.stream(range(len(split.lights))):
        pass
    return time.process_time() - began


def print_factors() -> None:
    """What terms leave out of lobes, relative rms over lights and viewers by their cosine, by roughness, of plastic and metal."""
    for roughness in ROUGHNESSES:
        for name, along in (("plastic", 0.04), ("metal", 0.8)):
            words = [f"{terms}: {factored(roughness, along, 1.0, terms).left_out ** 0.5:.3f}" for terms in (*TERMS, 32)]
            print(f"roughness {roughness} {name}", *words)


def main() -> None:
    """Print rows per scene, receiver and way of sampling."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", type=Path, help="none: what terms leave out of lobes, by roughness")
    parser.add_argument("--side", type=int, default=32)
    parser.add_argument("--fit", action="store_true")
    parser.add_argument("--receivers", default="Figure,Ground")
    arguments = parser.parse_args()
    if not arguments.scenes:
        print_factors()
    lights = lighting(arguments.side)
    toward = random_directions(8 * VIEWERS, "sphere", np.random.default_rng(8))
    viewers = toward[toward[:, 2] > 0.2][:VIEWERS]  # as one looks at a figure on a ground
    for scene in arguments.scenes:
        for name in arguments.receivers.split(","):
            with tempfile.TemporaryDirectory() as scratch:
                source = prepared(scene, name, Path(scratch), "--gloss", "4")
                true, rows = np.zeros(0), {}
                for way in WAYS:
                    capture, f = traced(source, way, arguments.side, 4)
                    assert isinstance(capture, CubemapCapture)
                    rows[way] = Rows(capture, lights, viewers)
                    exact = rows[way].exact()
                    true = exact if way == "full" else true
                    print(
                        f"{scene.stem} {name} {way}: {f['sampled']:.1%} of the elements, {f['direct rays'] / 1e6:.1f} + "
                        f"{f['bounce rays'] / 1e6:.1f} M rays, {f['cpu s']:.1f} CPU s; whole BRDF {rows[way].errors(exact, true)}",
                        flush=True,
                    )
                print(f"  all T_i of 4 terms: {seconds_of_terms(capture, 4):.0f} CPU s, no ray")
                for terms in TERMS:
                    own = {way: rows[way].errors(rows[way].by_terms(terms), true) for way in WAYS}
                    print(f"  {terms} terms: full {own['full']}, neighbors {own['neighbors']}", flush=True)
                if arguments.fit:
                    print(f"  asset of neighbors: {rows['neighbors'].errors(rows['neighbors'].of_asset(), true)}", flush=True)


if __name__ == "__main__":
    main()
