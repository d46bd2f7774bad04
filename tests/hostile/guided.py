"""One parser or reader fed what coverage leads to: `python guided.py NAME SECONDS FOLDER`, where atheris is installed.

It ends with 0 where nothing was found; what was found lies in FOLDER.
"""

import random
import shutil
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import atheris

# What numba compiles can't count where it comes along.
with atheris.instrument_imports(
    include=[
        "bridge", "gcs_plugin", "identify.ingest", "tui.commands.merge", "tui.commands.params", "tui.commands.prior",
        "tui.parameter_files", "pynmeagps", "pyubx2",
    ],
    exclude=["identify.ingest.mavlink.frames"],
):  # fmt: skip
    from fuzz_files import READERS, Reader
    from fuzz_streams import STREAMS, Stream

    from bridge.errors import SeatrialError

LONGEST_BYTES, LONGEST_S, MOST_MB = 4096, 20, 2000
AFRESH_AFTER = 500
SEEDS = 20


def feeding(stream: Stream) -> Callable[[bytes], None]:
    feed, fed = stream.make(), 0

    def run(data: bytes) -> None:
        nonlocal feed, fed
        # What is found must not need all that went before it.
        if fed % AFRESH_AFTER == 0:
            feed = stream.make()
        fed += 1
        feed(bytes(data), 0.001 * fed)

    return run


def reading(reader: Reader, folder: Path) -> Callable[[bytes], None]:
    def run(data: bytes) -> None:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        (folder / reader.name).write_bytes(bytes(data))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)
                reader.read(folder)
        except SeatrialError:
            pass

    return run


def main(name: str, seconds: str, folder: Path) -> None:
    corpus = folder / "corpus"
    corpus.mkdir(parents=True)
    result = next(first for first in (*STREAMS, *READERS) if first.name == name)
    if isinstance(result, Stream):
        first, good = feeding(result), (result.good,)
    else:
        first, good = reading(result, folder / "read"), result.good
    for number, data in enumerate((*good, *(result.craft(random.Random(seed)) for seed in range(SEEDS)))):
        (corpus / str(number)).write_bytes(data)
    options = {
        "max_total_time": seconds, "max_len": LONGEST_BYTES, "timeout": LONGEST_S, "rss_limit_mb": MOST_MB,
        "artifact_prefix": f"{folder}/", "verbosity": 0,
    }  # fmt: skip
    atheris.Setup([sys.argv[0], str(corpus), *(f"-{key}={value}" for key, value in options.items())], first)
    atheris.Fuzz()


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], Path(sys.argv[3]))
