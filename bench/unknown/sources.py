"""The code that the figures of drawn forces depend on (`bench.stamp`)."""

from bench.diagnosis.sources import ANSWERS as DIAGNOSED
from bench.stamp import reached

MADE = ("bench/unknown/grammar.py", "bench/unknown/planted.py", "bench/unknown/trials.py")
ANSWERS = tuple(sorted({*DIAGNOSED, *MADE, *reached(*MADE)}))
SECTION = (*ANSWERS, "bench/unknown/section.py", "bench/unknown/seeds.py", "bench/unknown/tables.py")
