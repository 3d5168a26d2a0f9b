"""Break one rule of safety or statistics at a time in a copy of the tree, and see that a test notices.

.venv/bin/python tools/mutants.py                        all of them, some ten minutes
.venv/bin/python tools/mutants.py --only speed --rust    those with a word in their name, in Rust too

Each mutant is a text replaced once in one file, and the few tests that should fail then. A text that is not
there any more is an error: the mutant has to follow the code. Not part of CI.
"""
# ruff: noqa: E501 - a mutant has a line

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True)
class Mutant:
    """A rule, the file that holds it, the text that is replaced by what, and the tests that should fail."""

    rule: str
    path: str
    old: str
    new: str
    tests: str


ATTEMPT, CHOOSING = "session/attempt.py", "session/choosing.py"
SAFETY, CALLS, LOOP = "session/safety.py", "session/calls.py", "session/loop.py"
JOURNAL, STORE, READING = "session/journal.py", "session/store.py", "robots/reading.py"
FOLDER, MANUAL = "cameras/folder.py", "robots/manual.py"
T_SAFETY, T_JOURNAL, T_CALLS = (
    "session/test_safety.py",
    "session/test_journal.py",
    "session/test_calls.py",
)
T_READING, T_FOLDER, T_MANUAL = "robots/test_reading.py", "cameras/test_folder.py", "robots/test_manual.py"
T_RULES, T_LOOP, T_BREAKS = "session/test_rules.py", "session/test_loop.py", "session/test_breaks.py"
T_RIG, T_WRONG_FIRST = "session/test_rig.py", "session/test_wrong_first_views.py"
T_COLLISIONS = "planning/test_collisions.py"
DECIDING, STEPPING, COMPARING = "session/deciding.py", "session/stepping.py", "session/comparing.py"
SELF, T_SELF = "session/self_calibration.py", "session/test_self_calibration.py"

# fmt: off
MUTANTS = (
    # What is sent.
    Mutant("workspace of the goal", SAFETY, "if not body.workspace.contains(", "if False and not body.workspace.contains(", T_SAFETY),
    Mutant("speed of the goal", SAFETY, "if goal.speed_rad_s > speed_rad_s", "if goal.speed_rad_s > 9 * speed_rad_s", T_SAFETY),
    Mutant("joints and pose are one place", SAFETY, "if not is_near(Pose(arm.forward(joints))", "if False and not is_near(Pose(arm.forward(joints))", T_SAFETY),
    Mutant("joints of the goal are there", SAFETY, "if goal.joints_rad is None:\n        return None if standing_rad is None", "if goal.joints_rad is None:\n        return None if True", T_SAFETY),
    Mutant("joints of the goal are numbers", SAFETY, "or not np.isfinite(joints).all()", "", T_SAFETY),
    Mutant("way to the goal", SAFETY, "return body.obstacle_on_path(standing_rad, joints)", "return body.obstacles(joints[np.newaxis])[0]", T_SAFETY),
    Mutant("nothing checked at all", SAFETY, "return body.obstacle_on_path(standing_rad, joints)", "return None", T_SAFETY),
    Mutant("tool takes part", SAFETY, "return Body(arm, workspace, mounted_points(believed), solids)", "return Body(arm, workspace, solids=solids)", T_SAFETY),
    Mutant("what is mounted with several cameras takes part", SAFETY, "return Body(arm, workspace, mounted_on_flange(believed), solids)", "return Body(arm, workspace, solids=solids)", T_RIG),
    Mutant("an arm goes back where its tool has no room", "session/rig_choosing.py", "            if joints is not None:\n", "            if False:\n", T_RIG),
    Mutant("a wrong station keeps no rig from its answer", "session/rig.py", "estimate is not None and all_agree(", "estimate is None or all_agree(", T_RIG + "::wrong_station"),
    Mutant("a rig's turns go on to the next axis", "session/rig_choosing.py", "if whole or tries == 2:", "if whole:", T_RIG),
    Mutant("check before sending", ATTEMPT, "    if why is not None:\n        return Missed(Failure.MOTION_REFUSED", "    if False:\n        return Missed(Failure.MOTION_REFUSED", T_SAFETY),
    Mutant("a dry run moves nothing", "cli/run.py", "if dry_run or session is None:", "if session is None:", "end_to_end/test_run.py"),
    Mutant("confirmation", ATTEMPT, "if cell.confirm is not None and not cell.confirm(goal):", "if False:", T_LOOP),
    Mutant("limits of the last joint", "planning/collisions.py", "beyond = np.any((joints < low_limit) | (joints > high_limit), axis=1)", "beyond = np.any(((joints < low_limit) | (joints > high_limit))[:, :-1], axis=1)", T_SAFETY),
    Mutant("lower limits", "planning/collisions.py", "(joints < low_limit) | (joints > high_limit)", "(joints > high_limit)", T_SAFETY),
    Mutant("floor", "planning/collisions.py", "low = np.any(frames[:, 3:, 2, 3]", "low = 0 * np.any(frames[:, 3:, 2, 3]", T_COLLISIONS),
    Mutant("workspace of the tool", "planning/collisions.py", "ends = np.concatenate([frames[:, -1:, :3, 3], tools], axis=1)", "ends = frames[:, -1:, :3, 3]", T_SAFETY),
    Mutant("touching itself", "planning/collisions.py", "touching[left] = self._touches_itself(", "touching[left] = False & self._touches_itself(", T_COLLISIONS),
    Mutant("the way, not its end alone", "planning/collisions.py", "why = self.obstacles(np.concatenate([path[1:] for path in paths]))", "why = self.obstacles(np.concatenate([np.tile(path[-1:], (len(path) - 1, 1)) for path in paths]))", T_COLLISIONS),
    Mutant("where the arm stands, in decisions", DECIDING, "for joints in (entry.standing_rad, told,", "for joints in (told,", T_SAFETY),
    Mutant("paths from the posture of the start", DECIDING, "        for entry in reversed(self.entries):\n            told", "        for entry in ():\n            told", T_SAFETY),
    Mutant("speed passed on", CHOOSING, 'return Goal(situation.label("view"), pose, joints, self._speed_rad_s)', 'return Goal(situation.label("view"), pose, joints)', T_SAFETY),
    Mutant("speed of the slowest joint", CHOOSING, "return min([self._wish.speed_rad_s, *turning.tolist()])", "return self._wish.speed_rad_s", T_SAFETY),
    Mutant("start where it may go", "session/configuration.py", '    if why is not None:\n        raise InputError(\n            f"the arm stands', '    if False:\n        raise InputError(\n            f"the arm stands', T_SAFETY),
    Mutant("drivers are closed", "cli/run.py", "    with closing(prepared.cell):\n        if dry_run", "    if True:\n        if dry_run", "end_to_end/test_run.py::closed"),
    Mutant("no robot is closed that may move", "session/closing.py", "cell.robot_calls.beside(seconds, cell.robot.stop)", "pass", "session/test_closing.py"),
    Mutant("no device is closed while a call runs", "session/closing.py", "            calls.run(seconds, call)", "            calls.beside(seconds, call)", "session/test_closing.py"),
    # What is believed.
    Mutant("a driver's picture may fill the memory", "cameras/protocol.py", "if image.size > MAX_PIXELS:", "if False:", "cameras/test_protocol.py"),
    Mutant("a file in the folder may be of any size", FOLDER, "if state.size > MAX_BYTES:", "if False:", T_FOLDER),
    Mutant("reading: limits", READING, "if fits and len(beyond) == 0:", "if fits:", T_READING),
    Mutant("reading: forward kinematics", READING, "fits = is_near(pose, reading.T_base_flange, AGREEMENT_M, AGREEMENT_RAD)", "fits = True", T_READING),
    Mutant("reading: number of joints", READING, "if len(joints) != len(arm):", "if len(joints) > 99:", T_READING),
    Mutant("reading: joints needed", READING, "        if joints_needed:", "        if False:", T_READING),
    Mutant("reading: type", READING, "if not isinstance(answer, Reading):", "if False:", T_READING),
    Mutant("reading: degrees named", READING, 'yield "the joint positions are in degrees, expected radians", radians', "pass", T_READING),
    Mutant("reading: inverse named", READING, "(inverse, reported.inverse()),", "", T_READING),
    Mutant("checked before every motion", ATTEMPT, "reading = checked_reading(answer, self.arm, joints_needed=not self.by_hand, expected=expected)", "reading = typed_reading(answer)", T_SAFETY),
    Mutant("contract at the start", STEPPING, "        check_at_rest(self._cell)\n", "", T_SAFETY),
    Mutant("stop works before the first motion", "session/contract.py", '    if why is not None:\n        raise DeviceError(\n            f"the robot cannot be stopped', '    if False:\n        raise DeviceError(\n            f"the robot cannot be stopped', T_SAFETY),
    Mutant("rest before the first motion", "session/contract.py", "if not is_near(first.T_base_flange, second.T_base_flange, REST_M, REST_RAD):\n        raise", "if False:\n        raise", T_SAFETY),
    Mutant("stop after a failure", ATTEMPT, "    if not refused:\n        stopped = cell.stop()", "    if False:\n        stopped = cell.stop()", T_SAFETY),
    Mutant("read again after a failure", ATTEMPT, "        cell.robot_calls.wait(cell.timeouts.move_s)\n        after = cell.read()", "        cell.robot_calls.wait(cell.timeouts.move_s)\n        after = before", T_SAFETY),
    Mutant("a robot that does not move", ATTEMPT, "before.T_base_flange, after.T_base_flange, STILL_M, STILL_RAD\n    ):", "before.T_base_flange, after.T_base_flange, STILL_M, STILL_RAD\n    ) and False:", T_SAFETY),
    Mutant("workspace of the pose read back", ATTEMPT, 'return "outside the workspace"', "return None", T_SAFETY),
    Mutant("posture read back", ATTEMPT, "return body.obstacles(np.array(reading.joints_rad)[np.newaxis])[0]", "return None", T_SAFETY),
    Mutant("stop where a motion ended wrongly", ATTEMPT, "    if why is not None:\n        cell.stop()\n        return Missed(Failure.ELSEWHERE", "    if why is not None:\n        return Missed(Failure.ELSEWHERE", T_SAFETY),
    # One command at a time.
    Mutant("wait for the last call", CALLS, "        self.wait(seconds)\n        return self._called(seconds, call, arguments, self._idle)", "        return self._called(seconds, call, arguments, self._idle)", T_CALLS),
    Mutant("stop goes beside", CALLS, "return self._called(seconds, call, arguments, threading.Event())", "return self.run(seconds, call, *arguments)", T_CALLS),
    Mutant("no clock in simulated cells", CALLS, "if math.isinf(seconds):\n            try:", "if False:\n            try:", T_CALLS),
    Mutant("short messages", CALLS, "MAX_MESSAGE = 300", "MAX_MESSAGE = 300_000", T_CALLS),
    Mutant("what can be shown", "errors.py", 'c if c.isprintable() else " " if c.isspace() else "?" for c in cut', "c for c in cut", T_CALLS),
    Mutant("a driver's exit ends no session", CALLS, "except BaseException as error:  # noqa: BLE001 - whatever a driver raises", "except Exception as error:", T_CALLS),
    Mutant("a robot that hangs ends the session", STEPPING, "if self._cell.robot_calls.pending:", "if False:", T_SAFETY),
    Mutant("a session told to go on goes on", STEPPING, "self._forgiven_up_to = situation.entries[-1].number", "pass", T_SAFETY),
    Mutant("a session without an answer goes on", STEPPING, "self._outvoted = situation.taken", "pass", T_WRONG_FIRST),
    Mutant("until new views outvote the old", DECIDING, "2 * self.outvoted + 1", "self.outvoted + 1", T_WRONG_FIRST),
    Mutant("in doubt no accuracy is reached", "session/rig_choosing.py", "if believed is not None and not situation.doubtful and", "if believed is not None and", T_RIG),
    Mutant("nor with one camera", DECIDING, "return self.doubtful or (", "return False and self.doubtful or (", T_LOOP),
    Mutant("what is in doubt judges no view", CHOOSING, "believed = None if situation.doubtful else estimate", "believed = estimate", T_LOOP),
    Mutant("no notation is blamed where joints tell the poses", "estimation/faults/alternatives.py", "if not (by_joints and h in OF_NUMBERS)", "if True", "estimation/faults/test_examine.py"),
    Mutant("no board of another size", "estimation/rig_checks.py", "if not scale_is_bearable(scale, BEARABLE_ALONE):", "if False:", "estimation/test_rig.py"),
    Mutant("no camera of another lens", "estimation/rig_checks.py", "prior, BEARABLE_ALONE):", "prior, 1e9):", "estimation/test_rig.py"),
    Mutant("views of other arms left out", LOOP, "if (len(view.joints_rad) == len(arm) if view.joints_rad is not None else not needed)", "if True", T_SAFETY),
    # Pictures of now.
    Mutant("stale frames", "cameras/capture.py", "STALE_FRAMES = 5", "STALE_FRAMES = 0", "cameras/test_capture.py"),
    Mutant("the same picture twice", ATTEMPT, 'if digest in digests:\n            return Missed(Failure.STALE_IMAGE, "the same points', 'if False:\n            return Missed(Failure.STALE_IMAGE, "the same points', T_SAFETY),
    Mutant("a picture that repeats itself", "session/judging.py", "UNCHANGED_PX = 0.5", "UNCHANGED_PX = 0.0", T_SAFETY),
    Mutant("frames are checked", "cameras/protocol.py", "if not isinstance(answer, Frame):", "if False:", "cameras/test_protocol.py"),
    Mutant("folder: settled", FOLDER, "SETTLED_S = 0.2", "SETTLED_S = 0.0", T_FOLDER),
    Mutant("folder: what lay there", FOLDER, "if old.get(name) == state:", "if False:", T_FOLDER),
    Mutant("folder: being written", FOLDER, "if name in growing:", "if False:", T_FOLDER),
    Mutant("folder: time", FOLDER, "if modified_s < asked_s - CLOCK_STEP_S:", "if False:", T_FOLDER),
    Mutant("folder: content", FOLDER, "if digest in self._digests:", "if False:", T_FOLDER),
    Mutant("folder: another format", FOLDER, "if self._stems.get(path.stem, name) != name:", "if False:", T_FOLDER),
    # The disk.
    Mutant("journal brought to the disk", JOURNAL, "                    file.write(line)\n                    file.flush()\n                    os.fsync(file.fileno())", "                    file.write(line)\n                    file.flush()", T_RULES),
    Mutant("recording brought to the disk", "datasets/writing.py", "        file.flush()\n        os.fsync(file.fileno())\n\n\ndef _beside", "        file.flush()\n\n\ndef _beside", T_RULES),
    Mutant("checkpoint brought to the disk", "compute/checkpoint.py", "    file.flush()\n    os.fsync(file.fileno())", "    file.flush()", "compute/test_checkpoint.py"),
    Mutant("chain of the journal", JOURNAL, "chain = _digest(chain + body)\n        entry", "chain = found or _digest(chain + body)\n        entry", T_JOURNAL),
    Mutant("journal follows from the settings", JOURNAL, 'chain, size, ending = known.digest, 0, b""', 'chain, size, ending = b"", 0, b""', T_JOURNAL),
    Mutant("settings are checked", JOURNAL, "    if changed:\n", "    if False:\n", T_JOURNAL),
    Mutant("nothing deleted", COMPARING, "    if more:\n", "    if False:\n", T_JOURNAL),
    Mutant("edited views", COMPARING, "elif not same(one, known[name]):", "elif False:", T_JOURNAL),
    Mutant("edited camera or mounting", COMPARING, "    if not same_header:\n", "    if False:\n", T_JOURNAL),
    Mutant("lost files made again", STORE, "        if not current:\n", "        if False:\n", T_JOURNAL),
    Mutant("partial files", STORE, "            remove_partials(part)", "            pass", T_JOURNAL),
    Mutant("another arm half-way", "session/settings.py", "if settings.get(name, fingerprint) != fingerprint:", "if False:", T_JOURNAL),
    Mutant("one process at a time", STORE, "fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)", "pass", T_BREAKS + "::test_two_processes_do_not_write_one_session"),
    Mutant("interruption stops the arm", STEPPING, "            self._cell.stop()\n            raise", "            raise", T_BREAKS + "::test_an_interruption_stops_the_arm_and_leaves_the_session_whole"),
    Mutant("torn line said", JOURNAL, "torn + len(rest))", "0)", T_JOURNAL),
    Mutant("zeros for a line", JOURNAL, 'if whole and not rest.strip(b"\\0") and b"\\0" in whole[-1]:', "if False:", T_JOURNAL),
    # A camera that nobody has calibrated.
    Mutant("lens is part of the request", "session/request.py", "if lens_px > self.lens_px:", "if False:", T_SELF),
    Mutant("a wrong view does not teach", SELF, "return worst if errors[worst] > limit else None", "return None", T_SELF),
    Mutant("no picture of a flat target", "session/judging.py", "if not rms <= LARGEST_BEND * extent:", "if False:", T_SELF),
    Mutant("pixels of the same pictures count once", SELF, "from_views=True", "from_views=False", T_SELF),
    Mutant("edited camera of a session that learns it", STORE, "if not same_camera(found.recording.camera, then):", "if False:", T_SELF),
    Mutant("the camera follows from the views", STORE, "grown if self.self_calibration is None else", "grown if True else", T_SELF),
    Mutant("begun with what was known then", "session/configuration.py", "recording = store.begun_with", "recording = store.recording", T_SELF),
    Mutant("a turn is no other lens", "estimation/lens_confidence.py", "return off - turns @ explained", "return off", "estimation/test_lens_confidence.py"),
    Mutant("tails of the lens", "estimation/lens_confidence.py", "estimate.degrees_of_freedom, probability", "np.inf, probability", "estimation/test_lens_confidence.py"),
    Mutant("ordinary lenses are believed in", "detection/intrinsics.py", "prior=ParameterPrior(mean, noise**2 / sigmas**2)", "prior=None", "detection/test_intrinsics.py"),
    # Statistics, and what people type.
    Mutant("one view that stands out is looked at", "session/judging.py", "off.max() <= limit and", "True or", "session/test_judging.py"),
    Mutant("tails of Student", "estimation/confidence.py", "if np.isfinite(degrees_of_freedom):", "if False:", T_RULES),
    Mutant("both radii", "session/request.py", "or now.rotation_deg > self.rotation_deg", "", T_RULES),
    Mutant("probability", "estimation/confidence.py", "PROBABILITY = 0.95", "PROBABILITY = 0.9", T_RULES),
    Mutant("seed of the candidates", CHOOSING, "np.random.default_rng([self._wish.seed, 4, len(situation.entries)])", "np.random.default_rng([0, 4, len(situation.entries)])", T_RULES),
    Mutant("order of the covariance", "types/calibration.py", '("tx_m", "ty_m", "tz_m", "rx_rad", "ry_rad", "rz_rad")', '("rx_rad", "ry_rad", "rz_rad", "tx_m", "ty_m", "tz_m")', "types/test_calibration.py"),
    Mutant("one view in both halves", "studies/protocol.py", "_indices(np.sort(order[middle:]))", "_indices(np.sort(order[middle - 1 :]))", "studies/test_protocol.py"),
    Mutant("one view held out and in the pool", "studies/protocol.py", "rest = np.sort(order[held_out_count:])", "rest = np.sort(order[max(held_out_count - 1, 0) :])", "studies/test_protocol.py"),
    Mutant("units by hand", MANUAL, "if _NEAREST_M <= far <= reach:", "if True:", T_MANUAL),
    Mutant("joints that nobody told", MANUAL, "shown = goal.joints_rad if self._arm is None or self._joints_told else None", "shown = goal.joints_rad", T_MANUAL),
    Mutant("asked again after a refusal", MANUAL, "        self._doubtful = True\n        self._reading = self._read(f", "        self._reading = self._read(f", T_MANUAL),
    Mutant("millimetres of the pendant", "notations/table.py", '"mm": 1e-3', '"mm": 1.0', T_MANUAL),
)

KINEMATICS = "crates/handeye-core/src/kinematics"
ESTIMATION = "crates/handeye-core/src/estimation"
SQUARES = "crates/handeye-core/src/least_squares"
POSTERIOR, MIXED, AGREEMENT = (f"{ESTIMATION}/{name}.rs" for name in ("posterior", "mixed", "agreement"))
CANDIDATE = "crates/handeye-core/src/information/candidate.rs"
POSE, INTERRUPT = (f"crates/handeye-core/src/{name}.rs" for name in ("pose/mod", "interrupt"))
CHAIN, INVERSE, BATCH = (f"{KINEMATICS}/{name}.rs" for name in ("chain", "inverse", "batch"))
RUST = (
    Mutant("core: upper limits", CHAIN, "(j.lower..=j.upper).contains(q)", "*q >= j.lower", "kinematics"),
    Mutant("core: lower limits", CHAIN, "(j.lower..=j.upper).contains(q)", "*q <= j.upper", "kinematics"),
    Mutant("core: length of a posture", CHAIN, "q.len() == self.len() && self.joints", "self.joints", "kinematics"),
    Mutant("core: number of joints", CHAIN, "joints.is_empty() || joints.len() > MAX_JOINTS", "joints.is_empty()", "kinematics"),
    Mutant("core: positions that are no numbers", BATCH, "!q.is_finite()", "q.is_infinite() && q.is_nan()", "kinematics"),
    Mutant("core: answers within the limits", INVERSE, "    q.clamp(lower, upper)\n", "    q\n", "kinematics"),
    Mutant("core: answers that reach", INVERSE, "off_m <= options.tolerance_m", "off_m <= 1e5 * options.tolerance_m", "kinematics"),
    Mutant("core: answers that turn", INVERSE, "off_rad <= options.tolerance_rad", "off_rad <= 1e5 * options.tolerance_rad", "kinematics"),
    Mutant("core: pixels of the same pictures count once", f"{ESTIMATION}/linearisation.rs", "if cell.cameras[m.camera].from_these_pixels {", "if false && cell.cameras[m.camera].from_these_pixels {", "estimation"),
    Mutant("core: pixel noise of a view", f"{ESTIMATION}/linearisation.rs", "&(m.pose.covariance * m.variance_px2)", "&m.pose.covariance", "estimation"),
    Mutant("core: stops where it is told", INTERRUPT, "if ASK.get().is_some_and(|ask| ask()) {", "if false {", "interrupt"),
    Mutant("core: asks nobody afterwards", INTERRUPT, "ASK.set(self.0);", "let _ = self.0;", "interrupt"),
    Mutant("core: checks between many things", INTERRUPT, "if number % STRIDE == 0 {", "if false {", "interrupt"),
    Mutant("core: what levels explain by chance", MIXED, "squared + factor.log_determinant() - factor.carried()", "squared - factor.carried()", "estimation"),
    Mutant("core: noise costs what it widens", MIXED, "self.settled.constant + log_determinant;", "self.settled.constant + 0.0 * log_determinant;", "estimation"),
    Mutant("core: constants cost what they widen", MIXED, "let mut constant = 2.0 * p.count as f64 * s.ln();", "let mut constant = 0.0;", "estimation"),
    Mutant("core: prior of the levels", MIXED, "            value += penalty;\n            slope[i] = first;\n            curvature[(i, i)] = second;", "            let _ = (penalty, first, second);", "estimation"),
    Mutant("core: inflation of a camera's covariance", MIXED, "view += m * weight;", "view += m;", "estimation"),
    Mutant("core: mean of a prior", MIXED, "view += pull;", "let _ = (&mut view, pull);", "estimation"),
    Mutant("core: what recurs costs what it widens", MIXED, "2.0 * (FUNCTIONS * p.count) as f64 * s.ln()", "0.0", "estimation"),
    Mutant("core: a camera that is taken at its word", f"{ESTIMATION}/components/camera.rs", "if self.prior.inflated { 0.5 } else { 1e-3 }", "0.5", "estimation"),
    Mutant("core: shares of the nodes", POSTERIOR, "weight: mode.value - answer.value - density,", "weight: -density,", "estimation"),
    Mutant("core: density of the nodes", POSTERIOR, "weight: mode.value - answer.value - density,", "weight: mode.value - answer.value + 0.0 * density,", "estimation"),
    Mutant("core: levels are averaged as wide as they are", f"{ESTIMATION}/nodes.rs", "let side = sides[usize::from(way * z > 0.0)];", "let side = 0.5 * (sides[0] + sides[1]);", "estimation"),
    Mutant("core: a wide side is no denser", f"{ESTIMATION}/nodes.rs", "density -= side.ln();", "density -= 0.0 * side.ln();", "estimation"),
    Mutant("core: answers of the nodes differ", POSTERIOR, "covariance.ger(node.weight, &away, &away, 1.0);", "let _ = away;", "estimation"),
    Mutant("core: degrees of freedom", f"{ESTIMATION}/degrees_of_freedom.rs", "(2.0 * total / spread", "(8.0 * total / spread", "estimation"),
    Mutant("core: fewest degrees of freedom", f"{ESTIMATION}/degrees_of_freedom.rs", "FREEDOM: f64 = 4.5", "FREEDOM: f64 = 1.0", "estimation"),
    Mutant("core: mean of the weak prior", f"{ESTIMATION}/weak_prior.rs", "(self.x_translation_m - x.translation)", "self.x_translation_m", "estimation"),
    Mutant("core: a station is no witness of itself", AGREEMENT, "(&noise - &spread).cholesky()?", "(&noise + &spread).cholesky()?", "estimation"),
    Mutant("core: nodes without the station", AGREEMENT, "node.log_weight - if inside { density } else { 0.0 }", "node.log_weight", "estimation"),
    Mutant("core: what others say is not exact", AGREEMENT, "(mean, noise + spread)", "(mean, noise)", "estimation"),
    Mutant("core: gate of the right chi-square", AGREEMENT, "for i in 1..degrees / 2 {", "for i in 1..degrees {", "estimation"),
    Mutant("core: evidence of a set counts its levels", AGREEMENT, "log_evidence: -mode.value - 0.5 * spread", "log_evidence: -mode.value", "estimation"),
    Mutant("core: noise of the pixels", f"{SQUARES}/accumulate.rs", "let weight = 1.0 / (sigma * sigma);", "let weight = 1.0 / sigma;", "least_squares"),
    Mutant("core: weights of the points", f"{ESTIMATION}/pixel_rows.rs", "let root = weight.sqrt();", "let root = weight.sqrt() / weight.sqrt();", "estimation"),
    Mutant("core: an arm that errs, in each view", f"{SQUARES}/marginal.rs", "let h = Matrix6::identity() + ", "let h = Matrix6::identity() * 2.0 + ", ""),
    Mutant("core: fewest views", f"{SQUARES}/problem.rs", "pub const MIN_VIEWS: usize = 3;", "pub const MIN_VIEWS: usize = 2;", "least_squares"),
    Mutant("core: poses that pixels leave open", POSE, "            determined(&sums.information)?;\n            let", "            let", "pose"),
    Mutant("core: margin of the picture", CANDIDATE, "pixel.x <= width - 1.0 - margin", "pixel.x <= width - 1.0", "information"),
    Mutant("core: other postures", INVERSE, "const DISTINCT: f64 = 1e-3;", "const DISTINCT: f64 = 10.0;", "kinematics"),
)

# fmt: on


def copied(root: Path) -> None:
    """Copy what git knows, and the built core, into an empty folder."""
    files = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split("\n")
    built = [str(path.relative_to(ROOT)) for path in (ROOT / "python" / "handeye").glob("_core*")]
    for name in {*files, *built} - {""}:
        if (ROOT / name).is_file():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, root / name)


def fails(root: Path, mutant: Mutant, *, rust: bool) -> bool:
    """Tell whether the tests of a mutant fail."""
    if rust:
        command = ["cargo", "test", "--quiet", "--locked", "-p", "handeye-core", "--lib"]
        # What all mutants share is compiled once.
        environment = dict(os.environ) | {"CARGO_TARGET_DIR": str(ROOT / "target" / "mutants")}
        built = subprocess.run(
            [*command, "--no-run"], cwd=root, env=environment, capture_output=True, check=False
        )
        if built.returncode != 0:
            raise RuntimeError(built.stderr.decode()[-2000:])
        command += [mutant.tests]
    else:
        test, _, name = mutant.tests.partition("::")
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", f"tests/{test}"]
        command += ["-k", name] if name else []
        environment = dict(os.environ) | {"PYTHONPATH": str(root / "python"), "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        done = subprocess.run(
            command, cwd=root, env=environment, capture_output=True, check=False, timeout=900
        )
    except subprocess.TimeoutExpired:
        return True
    if not rust and done.returncode not in {0, 1, 2}:
        raise RuntimeError(done.stdout.decode()[-2000:] + done.stderr.decode()[-2000:])
    return done.returncode != 0


def main() -> int:
    """Try every mutant; return 1 if one is not noticed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", nargs="+", default=[""], help="words of the rules")
    parser.add_argument("--rust", action="store_true", help="those in Rust, which take a minute each")
    options = parser.parse_args()
    mutants = [m for m in (RUST if options.rust else MUTANTS) if any(word in m.rule for word in options.only)]
    unnoticed: list[str] = []
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        copied(root)
        for number, mutant in enumerate(mutants, start=1):
            path = root / (mutant.path if options.rust else f"python/handeye/{mutant.path}")
            text = path.read_text()
            if mutant.old not in text:
                print(f"{mutant.rule}: the text to replace is not in {mutant.path} any more")
                return 2
            began = time.monotonic()
            path.write_text(text.replace(mutant.old, mutant.new, 1))
            noticed = fails(root, mutant, rust=options.rust)
            path.write_text(text)
            if not noticed:
                unnoticed.append(mutant.rule)
            seconds = time.monotonic() - began
            said = "noticed" if noticed else "NOT NOTICED"
            print(f"{number:>3} of {len(mutants)} {said:<11} {seconds:5.1f} s  {mutant.rule}", flush=True)
    print(f"{len(mutants) - len(unnoticed)} of {len(mutants)} noticed; not: {', '.join(unnoticed) or 'none'}")
    return 1 if unnoticed else 0


if __name__ == "__main__":
    sys.exit(main())
