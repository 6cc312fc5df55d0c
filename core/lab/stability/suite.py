"""The whole suite: every technique, in both cores, on every case and every picture."""

import json
import time
from pathlib import Path

from ...catalogue import technique, techniques
from ...errors import RayscopeError, SceneError
from .cases import cases
from .examine import examine
from .examine_pictures import examined
from .pictures import pictures
from .single import single_precision
from .trial import given
from .truth import refusals, truth_row
from .walks import walks


def contestants(names=None):
    """Techniques with a core each; those for some kinds of ray hand over others. Embree and mathutils compute in
    float32 and are left out."""
    return [(row.name, core) for row in techniques() if row.family != "peers" and (names is None or row.name in names)
            for core in row.cores]


def variants(name, core):
    """Parameters of a technique that promise the same hits: every choice and switch besides the defaults, one at a
    time."""
    return [{p.name: value} for p in technique(name).parameters if p.choices or p.type is bool
            for value in (p.choices_in(core) if p.choices else (False, True))
            if value != p.default_in(core) and value not in p.inexact]


def takes(name, case):
    """Whether a technique serves the kinds of primitive in a case, and the case is one for it."""
    kind = technique(name).primitives
    return (not case.only or name in case.only) and (kind == "all" or not case.kinds - {kind})


class Kept:
    """Cases that are done, in a file: one line each, so that a run which was stopped goes on where it was.

    Parameters
    ----------
    path : path-like or None
        None keeps nothing.
    asked : dict
        What the run was asked for; a file of another run is begun anew.
    resume : bool
        Take over what is in the file.
    """

    def __init__(self, path, asked, resume):
        self.path, self.done = path and Path(path), {}
        if path is None:
            return
        head = json.dumps({"run": asked})
        lines = self.path.read_text(encoding="utf-8").splitlines(keepends=True) if resume and self.path.exists() else []
        if lines and lines[0].strip() == head:
            lines = [line for line in lines if line.endswith("\n")]      # the last may have been cut off
            self.done = {record["case"]: record for record in map(json.loads, lines[1:])}
        else:
            lines = [head + "\n"]
        self.path.write_text("".join(lines), encoding="utf-8")

    def __call__(self, case, work):
        """A case's record: the one in the file, or what `work(case)` returns, which goes there."""
        if case.name not in self.done:
            record = {"case": case.name, **work(case)}
            if self.path is None:
                return record
            line = json.dumps(record, default=lambda x: x.item())
            with self.path.open("a", encoding="utf-8") as file:
                file.write(line + "\n")
            self.done[case.name] = json.loads(line)
        return self.done[case.name]


def run(full=False, seed=0, names=None, only=None, seconds=None, timed=True, say=lambda line: None, kept=None,
        resume=False):
    """Run the suite.

    Parameters
    ----------
    full : bool
        Larger scenes, more rays, every power of ten.
    seed : int
    names, only : collection of str, optional
        Techniques, and cases.
    seconds : float, optional
        No new case begins later than this; those left are named in `left_out`.
    timed : bool
        Also compare times.
    say : callable
        Called with a line of text at each case: which one, how many there are, how long it may take.
    kept : path-like, optional
        File to which each case's rows go as soon as it is done.
    resume : bool
        Take over the cases that are in that file already, if they were asked for in the same way.

    Returns
    -------
    dict
        rows : one a technique, core and case, with the keys COLUMNS. truth : one a case, with the keys TRUTH_COLUMNS.
        walks : one a walk and case, with the keys WALK_COLUMNS.
        pictures : one a technique, core and picture, with the keys of `examine_pictures`. single : see
        :func:`single_precision`.
        left_out : list of str. failures : rows whose verdict is not ok. failed : bool. run : seed and full.

    Raises
    ------
    RayscopeError
        For an unknown case.
    """
    everything, drawn = cases(full), pictures(full)
    names_of_cases = [c.name for c in (*everything, *drawn)]
    unknown = set(only or ()) - set(names_of_cases)
    if unknown:
        raise SceneError(f"There is no case {', '.join(sorted(unknown))}. Cases: {', '.join(names_of_cases)}.")
    began, rows, truths, led, drawn_rows, left_out, base, known, pace = time.monotonic(), [], [], [], [], [], {}, {}, {}
    kept = Kept(kept, {"seed": seed, "full": full, "names": names and sorted(names), "timed": timed}, resume)
    with_pictures = not only or any(c.name in only for c in drawn)
    # what times are compared with
    first = {"friendly", drawn[0].name if with_pictures else ""} if timed else set()
    chosen = [c for c in (*everything, *drawn) if not only or c.name in only or c.name in first]

    def done(case):
        """A case's record, if there is time for it."""
        if seconds is not None and time.monotonic() - began > seconds:
            left_out.append(f"{case.name}: there was no time.")
            return None
        if case.name not in kept.done:
            now = chosen.index(case)
            before = sum(c.name not in taken_over for c in chosen[:now])
            gone = time.monotonic() - began
            left = f", {gone / 60:.0f} minutes gone, {gone / max(before, 1) * (len(chosen) - now) / 60:.0f} left if cases take equally long" if gone > 60 else ""
            say(f"{case.name} ({now + 1} of {len(chosen)}{left})")
        return kept(case, rays_work if case in everything else pictures_work)

    def rays_work(case):
        """The rows of a case with rays."""
        scene, batch, right = given(case, seed, full)
        record = {"truth": truth_row(case, scene, batch, right, full), "walks": walks(case, scene, batch, names), "rows": [], "left_out": []}
        for name, core in contestants(names):
            if core not in case.cores:
                continue
            if not takes(name, case):
                record["left_out"].append(f"{case.name}: not with {name}.")
                continue
            for parameters in [{}, *(variants(name, core) if full and case.varied else ())]:
                try:
                    row = examine(case, scene, batch, right, name, core, seed, base.get((name, core)),
                                  timed and not parameters, parameters)
                except RayscopeError:
                    raise
                # a technique that breaks is a finding, not our end
                except Exception as error:
                    row = {"case": case.name, "technique": name, "core": core, "rays": len(batch),
                           "parameters": parameters,
                           "bad": list(range(len(batch))), "verdict": f"broke: {type(error).__name__}: {error}"}
                record["rows"].append(row)
        return record

    def pictures_work(case):
        """The rows of a picture."""
        return {"rows": examined(case, seed, contestants(names), pace, known), "left_out": []}

    taken_over = set(kept.done)
    for case in chosen:
        if (record := done(case)) is None:
            continue
        left_out += record["left_out"]
        for row in record["rows"]:
            if case.name in first and "seconds" in row and not row.get("parameters"):
                (base if case in everything else pace)[row["technique"], row["core"]] = row
        if case in everything:
            truths.append(record["truth"])
            led += record.get("walks", [])
            rows += record["rows"]
        else:
            drawn_rows += record["rows"]
    truths += refusals(seed) if not only else []
    say("float32")
    single = single_precision([c for c in chosen if c in everything], seed) if names is None else []
    failures = [r for r in rows + truths + led + drawn_rows + single if not r["verdict"].startswith(("ok", "refused"))]
    return {"rows": rows, "truth": truths, "walks": led, "pictures": drawn_rows, "single": single, "left_out": left_out,
            "failures": failures, "failed": bool(failures), "seconds": time.monotonic() - began,
            "run": {"seed": seed, "full": full}}
