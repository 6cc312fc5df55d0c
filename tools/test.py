"""Run the tests in every Blender there is, all parts even if one fails, and sum up: tools/test.py [PART ...]

Parts: core (no bpy) · addon (bpy 5.2) · addon-4.5 (bpy 4.5 LTS) · blender (a real `blender -b`) · gui (a real window
under Xvfb). The core, which takes as long as all others, runs beside them; each line says which part it is from.
"""
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from blenders import find_blender, find_window

ROOT = Path(__file__).resolve().parent.parent
MAIN, LTS = ROOT / ".venv/bin/python", ROOT / ".venv-4.5/bin/python"
LONGEST = 3000  # seconds for one part: then pytest ends with what it has found
HANGING = LONGEST + 600  # and then it is killed
OPTIONS = ["-q", "-rfEs", f"--session-timeout={LONGEST}"]
PYTEST = ["-m", "pytest", *OPTIONS]


class LeftOut(Exception):
    """This part cannot be run here; says why."""


def core():
    folders = [name for name in ("core", "literature", "stability") if any((ROOT / "tests" / name).glob("test_*.py"))]
    return [MAIN, *PYTEST, *(f"tests/{name}" for name in folders)], {"RAYSCOPE_WITHOUT_BPY": "1"}


def addon():
    return [MAIN, *PYTEST, "tests/addon"], {}


def addon_lts():
    if not (ROOT / ".venv-4.5/.complete").exists():
        raise LeftOut("no .venv-4.5: Python 3.11 or bpy 4.5 could not be had")
    return [LTS, *PYTEST, "tests/addon"], {}


def blender():
    command = _blender()
    site = {} if "blender-chroot" in command[0] else {"TEST_SITE": os.environ.get("TEST_SITE") or _test_site(command)}
    script = ["-b", "--factory-startup", "--python-exit-code", "1", "--python", "tests/run_in_blender.py"]
    # The core's slow tests do not depend on who runs Python, and have run in the part "core".
    return [*command, *script, "--", *OPTIONS, "-m", "not slow", "tests/addon", "tests/core"], site


def gui():
    _, why_not = find_window(_blender())
    if why_not:
        raise LeftOut(why_not)
    return [MAIN, *PYTEST, "tests/gui"], {}


PARTS = {"core": core, "addon": addon, "addon-4.5": addon_lts, "blender": blender, "gui": gui}


def _blender():
    command, why_not = find_blender()
    if why_not:
        raise LeftOut(why_not)
    return command


def _test_site(command):
    """A folder with pytest and the like for the Python of this Blender."""
    tell = ["-b", "--factory-startup", "--python-expr", "import sys; print('PYTHON %d.%d' % sys.version_info[:2])"]
    version = re.search(r"PYTHON (\S+)", subprocess.run([*command, *tell], text=True, capture_output=True).stdout).group(1)
    site = ROOT / f".tools/site-{version}"
    if not site.exists():
        pip = ["-m", "pip", "install", "-q", "--only-binary=:all:", "--python-version", version, "--target", site]
        if subprocess.run([sys.executable, *pip, "pytest", "pytest-timeout", "hypothesis", "embreex"]).returncode:
            raise LeftOut(f"pytest for Python {version} cannot be had; give a folder with it in TEST_SITE")
    return str(site)


_running = []


def _stop(*_):
    """Interrupted: nothing goes on behind our back."""
    for process in _running:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
    os._exit(143)


def run(name):
    """Run one part; returns (verdict, figures, seconds, what pytest says of each test that failed)."""
    start = time.monotonic()
    try:
        command, environment = PARTS[name]()
    except LeftOut as reason:
        return "LEFT OUT", {"reason": str(reason)}, 0.0, []
    command = [str(word) for word in command]
    print(f"#### {name}: {' '.join(command)}", flush=True)
    lines = []
    with tempfile.TemporaryDirectory(prefix="rayscope-user-") as user:
        # Only a Blender that is started anew needs its folder from here;
        # the bpy module's is made in tests/addon/conftest.py.
        fresh = {"BLENDER_USER_RESOURCES": user} if name == "blender" else {}
        process = subprocess.Popen(
            command, cwd=ROOT, env={**os.environ, **environment, **fresh}, text=True, errors="replace",
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True,
        )  # fmt: skip
        _running.append(process)
        alarm = threading.Timer(HANGING, os.killpg, (process.pid, signal.SIGKILL))
        alarm.start()
        try:
            for line in process.stdout:
                print(f"{name}: {line}", end="", flush=True)
                lines.append(line)
            code = process.wait()
        finally:
            alarm.cancel()
    figures = _figures(lines)
    seconds = time.monotonic() - start
    wrong = [line.rstrip() for line in lines if re.match(r"(FAILED|ERROR) tests/|!!.* session.*timeout", line)]
    if code == -signal.SIGKILL and seconds >= HANGING:
        return "TIMED OUT", figures, seconds, wrong
    # A Blender that crashes may still exit with 0: without pytest's closing line nothing has passed.
    passed = code == 0 and figures.get("passed", 0) > 0
    return ("passed" if passed else f"FAILED (exit {code})"), figures, seconds, wrong


def _figures(lines):
    closing = [line for line in lines if re.search(r"\b(passed|failed|errors?|skipped)\b.* in [\d.]+s", line)]
    found = re.findall(r"(\d+) (passed|failed|error|skipped)", closing[-1]) if closing else []
    return {word: int(number) for number, word in found}


def main(names):
    signal.signal(signal.SIGTERM, _stop)
    signal.signal(signal.SIGINT, _stop)
    unknown = set(names) - set(PARTS)
    if unknown:
        sys.exit(f"unknown part: {', '.join(unknown)}; there are {', '.join(PARTS)}")
    names = names or list(PARTS)
    others = [name for name in names if name != "core"]
    with ThreadPoolExecutor(1) as beside:
        first = beside.submit(run, "core") if "core" in names else None
        results = {name: run(name) for name in others}
        results = ({"core": first.result()} if first else {}) | results
    print("\n#### Summary")
    total = dict.fromkeys(("passed", "failed", "error", "skipped"), 0)
    for name, (verdict, figures, seconds, wrong) in results.items():
        if verdict == "LEFT OUT":
            print(f"{name:10} LEFT OUT: {figures['reason'].upper()}")
            continue
        print(f"{name:10} {verdict:18} {', '.join(f'{number} {word}' for word, number in figures.items()):32} {seconds:6.1f} s")
        print(*(f"    {line}" for line in wrong), sep="\n", end="\n" * bool(wrong))
        for word, number in figures.items():
            total[word] += number
    bad = [name for name, (verdict, *_) in results.items() if verdict not in ("passed", "LEFT OUT")]
    failed = max(total["failed"] + total["error"], len(bad))
    print(f"{total['passed']} passed, {failed} failed, {total['skipped']} skipped")
    ran = total["passed"] > 0  # that everything was left out is no success
    return 0 if ran and not bad else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
