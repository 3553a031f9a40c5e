"""Blocks of images, read ahead by a thread per core."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from srbf.compute.threads import cores
from srbf.io.float16 import finite_to_float32


def blocks(
    read: Callable[[int], np.ndarray], count: int, texels: int, size: int, dtype: np.dtype, buffers: int
) -> Iterator[tuple[int, np.ndarray]]:
    """(number of the block's first image, images (b, texels, 3) of `dtype`), `size` images at a time, the next block read ahead.

    `read` gives image i of `count` as (texels, 3) float16 or float32, and is called from several threads. Blocks are views of `buffers`
    arrays (2 or more) used in turn: a block is valid until the next iteration. With 0 buffers each block is a new array.
    """
    shape = (min(size, count), texels, 3)
    ring = [np.empty(shape, dtype) for _ in range(buffers)]

    def fill(index: int, target: np.ndarray) -> None:
        image = read(index)
        if image.dtype == np.float16 and dtype == np.float32:
            finite_to_float32(image, target)
        else:
            target[...] = image

    def start(first: int) -> tuple[int, np.ndarray, list[Future[None]]]:
        block = ring[first // size % buffers] if ring else np.empty(shape, dtype)
        block = block[: count - first]
        return first, block, [readers.submit(fill, first + i, target) for i, target in enumerate(block)]

    readers = ThreadPoolExecutor(cores())
    try:
        waiting = deque([start(0)] if count else [])
        while waiting:
            first, block, pending = waiting.popleft()
            if first + size < count:
                waiting.append(start(first + size))
            for done in pending:
                done.result()
            yield first, block
    finally:
        readers.shutdown(cancel_futures=True)
