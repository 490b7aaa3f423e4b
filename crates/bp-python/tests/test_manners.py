"""Threads, signals, forks and memory: a guest that behaves in Python's house."""
import os
import signal
import subprocess
import sys
import threading
import time

import bpstereo
import numpy
import pytest

from conftest import shifted

#: A match of many seconds, in short steps.
SLOW = {"algorithm": {"name": "bp", "loops": {"on_each_grid": {"loops": 20000, "schedule": "sync"}}}, "labels": 64}


def test_several_matchers_work_in_threads():
    pairs = [shifted(60, 80, shift) for shift in range(1, 7)]
    expected = [bpstereo.match(*pair, labels=16) for pair in pairs]
    found = [None] * len(pairs)

    def work(index):
        matcher = bpstereo.Matcher(labels=16)
        for _ in range(5):
            found[index] = matcher.compute(*pairs[index])

    threads = [threading.Thread(target=work, args=(index,)) for index in range(len(pairs))]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert all(numpy.array_equal(one, other, equal_nan=True) for one, other in zip(found, expected))


def ticks_a_second(work):
    """How often another thread gets to run in a second, at best each millisecond, while this one works."""
    ticks, done = [0], threading.Event()

    def count():
        while not done.is_set():
            ticks[0] += 1
            time.sleep(0.001)

    counter = threading.Thread(target=count, daemon=True)
    counter.start()
    begin, before = time.monotonic(), ticks[0]
    work()
    rate = (ticks[0] - before) / (time.monotonic() - begin)
    done.set()
    counter.join()
    return rate


def test_other_threads_run_meanwhile():
    # No callback, which would let them run.
    loops = {"on_each_grid": {"loops": 900, "schedule": "sync"}}
    matcher = bpstereo.Matcher(algorithm={"name": "bp", "loops": loops}, labels=64, threads=1)
    pair = shifted(200, 250, 4)
    while_idle = ticks_a_second(lambda: time.sleep(0.3))
    # If the match held Python's lock, they would get a turn every 50 ms at best, when it looks at signals.
    assert ticks_a_second(lambda: matcher.compute(*pair)) > while_idle / 8
    assert matcher.times["total"] > 0.3, "the match was too short to tell"


def test_a_matcher_at_work_refuses_other_threads():
    matcher, refused = bpstereo.Matcher(**SLOW), []
    done = threading.Event()

    def watch():
        while not done.is_set():
            try:
                matcher.times
            except RuntimeError as error:
                refused.append(str(error))
            time.sleep(0.01)

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    begin = time.monotonic()
    with pytest.raises(TimeoutError):
        matcher.compute(*shifted(400, 500, 4), progress=lambda done, total: stop_after(begin, 0.5))
    done.set()
    watcher.join()
    assert refused and all("at work" in text for text in refused)
    assert matcher.times is None


def stop_after(begin, seconds):
    if time.monotonic() - begin > seconds:
        raise TimeoutError


def test_progress_is_told_and_its_errors_stop_the_match():
    told = []
    bpstereo.match(*shifted(100, 120, 4), labels=16, progress=lambda done, total: told.append((done, total)))
    assert told and told[-1][0] == told[-1][1] and told == sorted(told)
    begin = time.monotonic()
    with pytest.raises(ZeroDivisionError):
        bpstereo.match(*shifted(400, 500, 4), progress=lambda done, total: 1 // 0, **SLOW)
    assert time.monotonic() - begin < 2


def test_a_slow_callback_does_not_delay_the_answer():
    begin = time.monotonic()
    loops = {"on_each_grid": {"loops": 200, "schedule": "sync"}}
    bpstereo.match(*shifted(60, 80, 4), labels=16, algorithm={"name": "bp", "loops": loops}, progress=lambda *_: time.sleep(0.2))
    assert time.monotonic() - begin < 3


def test_a_callback_may_not_use_its_own_matcher(pair):
    matcher = bpstereo.Matcher(labels=16)
    with pytest.raises(RuntimeError, match="callback"):
        matcher.compute(*pair, progress=lambda *_: matcher.compute(*pair))
    assert matcher.compute(*pair).shape == pair[0].shape


def seconds_to_stop(code, moment):
    """Sends Ctrl-C to the code, `moment` seconds after it said "go". The seconds until it raised KeyboardInterrupt."""
    begin, end = """
import signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # it may be ignored where the tests run in the background
""", """
except KeyboardInterrupt:
    print(time.monotonic())
"""
    process = subprocess.Popen([sys.executable, "-c", begin + code + end], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    process.stdout.readline()
    time.sleep(moment)
    sent = time.monotonic()
    process.send_signal(signal.SIGINT)
    raised, told = process.communicate(timeout=60)
    assert process.returncode == 0 and raised, told
    return float(raised) - sent


def test_ctrl_c_stops_a_match_of_short_steps():
    code = f"""
sys.path.insert(0, {os.path.dirname(__file__)!r})
import bpstereo
from conftest import shifted
pair = shifted(480, 640, 4)
try:
    print("go", flush=True)
    bpstereo.match(*pair, **{SLOW!r})
"""
    assert seconds_to_stop(code, 1) < 1


def test_ctrl_c_ends_the_reading_of_large_images():
    # Every other column: values that do not lie side by side. Reading and matching this takes many seconds.
    code = """
import bpstereo, numpy
image = numpy.random.default_rng(1).random((6000, 12000), dtype=numpy.float32)[:, ::2]
matcher = bpstereo.Matcher(labels=64)
try:
    print("go", flush=True)
    matcher.compute(image, image)
"""
    for moment in (0.02, 0.3):
        assert seconds_to_stop(code, moment) < 1


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("kind", ["grey", "stretched", "large colours"])
def test_a_matcher_works_after_a_fork(pair, kind):
    matcher = bpstereo.Matcher(labels=16, stretch=kind == "stretched")
    if kind == "large colours":
        pair = [numpy.dstack([image, image, 255 - image]) for image in shifted(500, 600, 3)]
    expected = matcher.compute(*pair)
    child = os.fork()
    if child == 0:
        try:
            same = numpy.array_equal(matcher.compute(*pair), expected, equal_nan=True)
            os._exit(0 if same else 1)
        finally:
            os._exit(2)
    deadline = time.monotonic() + 20
    while time.monotonic() < deadline:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            break
        time.sleep(0.05)
    else:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        pytest.fail("the child hangs")
    assert os.waitstatus_to_exitcode(status) == 0
    assert numpy.array_equal(matcher.compute(*pair), expected, equal_nan=True)


def resident():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def least_growth(match, count):
    """Bytes that the process grew by over `count` matches: the least of three times. An allocator grows once; what leaks grows always."""
    held = []
    for _ in range(4):
        for _ in range(count):
            match()
        held.append(resident())
    return min(after - before for before, after in zip(held, held[1:]))


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="there is no /proc")
def test_a_thousand_matches_leak_nothing():
    pair = shifted(48, 64, 3)
    # A map of these is 12 kB: the limits are a third of one for each match.
    matcher = bpstereo.Matcher(labels=8, confidence=True, threads=1)
    assert least_growth(lambda: matcher.compute(*pair), 250) < 250 * 4096
    assert least_growth(lambda: bpstereo.match(*pair, labels=8, threads=1), 30) < 30 * 4096


@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="there is no /proc")
def test_a_match_holds_no_more_than_predicted():
    code = """
import bpstereo, numpy
scene = numpy.random.default_rng(1).integers(0, 256, (900, 1240), dtype=numpy.uint8)
left, right = scene[:, :1200], scene[:, 20:1220]
most = lambda: 1024 * int(next(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM:")))
matcher = bpstereo.Matcher(labels=64, threads=1)
predicted, before = matcher.peak_bytes(left, right), most()
matcher.compute(left, right)
print(predicted, most() - before)
"""
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    predicted, grown = map(int, done.stdout.split())
    assert predicted / 4 < grown <= predicted
    with pytest.raises(MemoryError):
        bpstereo.Matcher(labels=64, max_memory=30 << 20).peak_bytes(*shifted(900, 1200, 4))


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="counts threads in /proc")
def test_matchers_end_their_threads(pair):
    begin = len(os.listdir("/proc/self/task"))
    for _ in range(5):
        bpstereo.match(*pair, labels=8, threads=4)
    deadline = time.monotonic() + 5
    while len(os.listdir("/proc/self/task")) > begin and time.monotonic() < deadline:
        time.sleep(0.05)
    assert len(os.listdir("/proc/self/task")) <= begin
