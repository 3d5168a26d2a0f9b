"""Find a target in many images."""

import hashlib
import itertools
import os
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from handeye.codes import Code
from handeye.detection.base import Detection, Image, NotFound
from handeye.detection.detect import VERSION, detect
from handeye.errors import DetectionError, HandeyeError
from handeye.types import Target

# Images for each worker that are handed out before the first of them is done.
WAITING = 4


class DetectionCache:
    """What was found, in memory only, by content of the image, target and version of the detectors.

    Examples
    --------
    >>> cache = DetectionCache()
    >>> type(cache.detect(np.full((480, 640), 255, np.uint8), board)).__name__
    'NotFound'
    """

    def __init__(self) -> None:
        self._found: dict[tuple[bytes, tuple[int, ...], Target, int], Detection | NotFound] = {}

    def detect(self, image: Image, target: Target) -> Detection | NotFound:
        """As `handeye.detection.detect`, without doing the same work twice."""
        key = (
            hashlib.blake2b(np.ascontiguousarray(image).data, digest_size=16).digest(),
            image.shape,
            target,
            VERSION,
        )
        if key not in self._found:
            self._found[key] = detect(image, target)
        return self._found[key]

    def __len__(self) -> int:
        return len(self._found)


@dataclass(frozen=True)
class Batch:
    """What became of many images, by name.

    Attributes
    ----------
    found
        The detections, in the order of the images.
    failed
        The error of every other image: it could not be read, or the target was not found in it.

    Examples
    --------
    >>> Batch().found, Batch().failed
    ({}, {})
    """

    found: Mapping[str, Detection] = field(default_factory=dict[str, Detection])
    failed: Mapping[str, HandeyeError] = field(default_factory=dict[str, HandeyeError])

    def raise_if_none(self) -> None:
        """Raise if the target was found in no image.

        Raises
        ------
        DetectionError
            With the first failure as example.
        """
        if not self.found:
            name, error = next(iter(self.failed.items()), ("", None))
            example = "" if error is None else f"; {name}: {error.message.removeprefix(f'{name}: ')}"
            raise DetectionError(
                f"the target was found in none of {len(self.failed)} images{example}",
                code=Code.NOT_DETECTED,
                hint=None if error is None else error.hint,
            ) from error


def detect_all(
    images: Iterable[tuple[str, Callable[[], Image]]],
    target: Target,
    *,
    progress: Callable[[str, Detection | HandeyeError], None] | None = None,
    cache: DetectionCache | None = None,
    workers: int | None = None,
) -> Batch:
    """Find the target in many images, side by side; a failure stops nothing.

    What is found and the order in which it is reported depend neither on the number of workers nor on how
    busy the machine is. Whatever `progress` raises, an interruption too, ends the work after the images that
    are being looked at.

    Errors of images are in the answer.

    Parameters
    ----------
    images
        Names, and functions that give the image, called by the workers: no more images than workers are in
        memory.
    target
        What to look for.
    progress
        Called in the caller's thread after each image, in their order, with its name and what came of it.
    cache
        Remembers what was found before; a new one by default.
    workers
        Threads, at least one; by default one for each processor.

    Examples
    --------
    >>> white = np.full((480, 640), 255, np.uint8)
    >>> list(detect_all([("img_1", lambda: white)], board).failed)
    ['img_1']
    """
    memory = DetectionCache() if cache is None else cache
    count = max(1, workers or processors())
    found: dict[str, Detection] = {}
    failed: dict[str, HandeyeError] = {}
    waiting: deque[tuple[str, Future[Detection | HandeyeError]]] = deque()
    pool = ThreadPoolExecutor(count, thread_name_prefix="detect")
    try:
        remaining = iter(images)
        while True:
            # Those that wait hold a name and a function, no image.
            for name, load in itertools.islice(remaining, WAITING * count - len(waiting)):
                waiting.append((name, pool.submit(_one, name, load, target, memory)))
            if not waiting:
                break
            name, future = waiting.popleft()
            outcome = future.result()
            if isinstance(outcome, Detection):
                found[name] = outcome
            else:
                failed[name] = outcome
            if progress is not None:
                progress(name, outcome)
    finally:
        pool.shutdown(cancel_futures=True)
    return Batch(found, failed)


def processors() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _one(
    name: str, load: Callable[[], Image], target: Target, cache: DetectionCache
) -> Detection | HandeyeError:
    try:
        result = cache.detect(load(), target)
    except HandeyeError as error:
        return error
    return result if isinstance(result, Detection) else result.error(name)
