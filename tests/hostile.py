"""Mistakes that people make in case files, and damage that files come by."""

import random
import re

# Each is a whole case file, or bytes that pretend to be one.
GOOD = """\
kinematics: plane_strain
resolution: 0.5 mm
bodies:
  projectile:
    material: aluminium-howell-ball
    shape: {type: disc, diameter: 5 mm}
    velocity: [3.1 km/s, 0]
  target:
    material: aluminium-howell-ball
    shape: {type: box, size: [2 mm, 20 mm]}
time: {end: 1 us}
"""


def changed(old, new):
    """The good case with one thing wrong."""
    assert old in GOOD
    return GOOD.replace(old, new).encode()


BOMB = "a: &a [lol, lol, lol, lol, lol, lol, lol, lol, lol]\n" + "".join(
    f"{chr(98 + k)}: &{chr(98 + k)} [{', '.join([f'*{chr(97 + k)}'] * 9)}]\n" for k in range(9)
)

MISTAKES = {
    "empty": b"",
    "only a comment": b"# nothing\n",
    "a list": b"- 1\n- 2\n",
    "a word": b"hello\n",
    "null": b"null\n",
    "tabs": GOOD.replace("  ", "\t").encode(),
    "unclosed bracket": changed("[3.1 km/s, 0]", "[3.1 km/s, 0"),
    "unclosed quote": changed("0.5 mm", '"0.5 mm'),
    "two documents": GOOD.encode() + b"---\n" + GOOD.encode(),
    "twice the same key": GOOD.encode() + b"time: {end: 2 us}\n",
    "unknown key": changed("time: {end: 1 us}", "tiem: {end: 1 us}"),
    "unknown material": changed(
        "material: aluminium-howell-ball\n    shape: {type: disc", "material: alu\n    shape: {type: disc"
    ),
    "no unit's dimension": changed("0.5 mm", "0.5 kg"),
    "unknown unit": changed("0.5 mm", "0.5 milimetres"),
    "minus": changed("0.5 mm", "-0.5 mm"),
    "zero": changed("0.5 mm", "0"),
    "nan": changed("0.5 mm", ".nan"),
    "infinity": changed("end: 1 us", "end: .inf"),
    "huge": changed("0.5 mm", "1e-300"),
    "huge power": changed("0.5 mm", "1e999999999"),
    "huge integer": changed("0.5 mm", "9" * 5000),
    "power tower": changed("0.5 mm", "9**9**9**9 mm"),
    "unit tower": changed("0.5 mm", "1 mm**9**9**9"),
    "more particles than memory": changed("0.5 mm", "1 nm"),
    "faster than light": changed("3.1 km/s", "3.1e9 km/s"),
    "too coarse": changed("0.5 mm", "5 mm"),
    "three components": changed("[3.1 km/s, 0]", "[3.1 km/s, 0, 0]"),
    "velocity as a word": changed("[3.1 km/s, 0]", "fast"),
    "boolean as a number": changed("0.5 mm", "true"),
    "sexagesimal": changed("0.5 mm", "1:30"),
    "decimal comma": changed("0.5 mm", "0,5 mm"),
    "shape of another dimension": changed("{type: disc, diameter: 5 mm}", "{type: sphere, diameter: 5 mm}"),
    "shape without type": changed("{type: disc, diameter: 5 mm}", "{diameter: 5 mm}"),
    "bodies overlap": changed("velocity: [3.1 km/s, 0]", "velocity: [0, 0]\n    position: [1 mm, 0]"),
    "no bodies": b"kinematics: plane_strain\nresolution: 1 mm\nbodies: {}\ntime: {end: 1 us}\n",
    "numbers as keys": changed("projectile:", "1:"),
    "list as key": changed("projectile:", "? [a, b]\n  :"),
    "python object": b"!!python/object/apply:os.system ['touch /tmp/hvisph-was-here']\n",
    "python name": changed("0.5 mm", "!!python/name:os.system ''"),
    "binary tag": changed("0.5 mm", "!!binary aGVsbG8="),
    "own tag": changed("0.5 mm", "!mine 3"),
    "timestamp": changed("0.5 mm", "2001-01-01"),
    "recursive anchor": b"a: &x [*x]\nkinematics: plane_strain\n",
    "recursive mapping": b"bodies: &b {projectile: *b}\nkinematics: plane_strain\nresolution: 1 mm\ntime: {end: 1 us}\n",
    "undefined alias": changed("0.5 mm", "*nowhere"),
    "bomb": BOMB.encode(),
    "deep": b"[" * 20000,
    "deep mapping": b"a: " + b"{a: " * 3000,
    "wide": b"x: [" + b"0," * 50_000 + b"0]\n",
    "long line": b"a" * 1_000_000,
    "latin-1": GOOD.replace("plane_strain", "plane_strain # Größe").encode("latin-1"),
    "utf-16": GOOD.encode("utf-16"),
    "utf-32": GOOD.encode("utf-32"),
    "byte order mark in the middle": changed("0.5 mm", "0.5 \ufeffmm"),
    "control characters": b"\x00\x01\x02kinematics: plane_strain\n",
    "a picture": b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 20,
    "an hdf5 file": b"\x89HDF\r\n\x1a\n" + bytes(2000),
    "random bytes": random.Random(1).randbytes(4000),
    "surrogate": b"title: \xed\xa0\x80\n",
    "based on itself": b"base: case.yaml\n",
    "based on nothing": b"base: /nowhere/at/all.yaml\n",
    "based on a folder": b"base: /\n",
    "based on a device": b"base: /dev/zero\n",
    "merge key": b"<<: {kinematics: plane_strain}\n" + GOOD.encode(),
    "checkpoint every nothing": GOOD.encode() + b"output: {checkpoint_every: 0}\n",
    "expectation of nothing": GOOD.encode() + b"expected: {crater: 3}\n",
    "domain inside out": GOOD.encode() + b"domain: {min: [1, 1], max: [0, 0]}\n",
    "clamp of nothing": GOOD.encode() + b"clamped: [{box: {min: [10, 10], max: [11, 11]}}]\n",
    "json with a mistake": b'{"kinematics": "plane_strain",, }',
    "windows line ends and a mistake": changed("0.5 mm", "0.5 mmm").replace(b"\n", b"\r\n"),
}


def damaged(content, rng):
    """Some bytes of a file gone, or one bit of it turned."""
    content = bytearray(content)
    if rng.random() < 0.5:
        return bytes(content[: rng.randrange(len(content))])
    content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
    return bytes(content)


NUMBER = re.compile(r"(?<![\w.])-?\d+\.?\d*(?:[eE][-+]?\d+)?(?![\w.])")
EXTREMES = ("0", "-1", "1e-300", "1e300", "5e-324", "1.7e308", "1e-29", "1e29", "1e-15", "1e15", "1e9", "1e-9", "3", "0.5",
            "1e6", "-0.0", "1e-3", "1e20", "1e-20")  # fmt: skip


def extreme(text, rng):
    """A case file with some of its numbers far too large or too small."""
    for _ in range(rng.randint(1, 3)):
        found = list(NUMBER.finditer(text))
        if found:
            one = rng.choice(found)
            text = text[: one.start()] + rng.choice(EXTREMES) + text[one.end() :]
    return text


def shifted(text, rng):
    """A case file with some of its numbers a few times too large or too small, or of the other sign."""
    for _ in range(rng.randint(1, 4)):
        found = list(NUMBER.finditer(text))
        if found:
            one = rng.choice(found)
            value = float(one.group()) * 10.0 ** rng.uniform(-1.5, 1.5) * rng.choice([1, 1, 1, -1])
            text = text[: one.start()] + f"{value:.4g}" + text[one.end() :]
    return text


def mutated(text, rng):
    """A case file after a few random slips of the pen."""
    lines = text.splitlines()
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(lines))
        line = lines[at]
        slip = rng.randrange(9)
        if slip == 0:
            del lines[at]
            lines = lines or [""]
        elif slip == 1:
            lines.insert(at, rng.choice(lines))
        elif slip == 2:
            lines[at] = line.replace(rng.choice(line) if line else "x", rng.choice("{}[]:,#&*!|>'\"%@` \t\0-1e9"), 1)
        elif slip == 3:
            lines[at] = " " * rng.randrange(9) + line.lstrip()
        elif slip == 4:
            cut = rng.randrange(len(line) + 1)
            lines[at] = (
                line[:cut]
                + rng.choice(["\u00e9", "\U0001f4a5", "nan", "-", "1e400", "~", "*a", "&a", "<<"])
                + line[cut:]
            )
        elif slip == 5:
            cut = rng.randrange(len(line) + 1)
            lines[at] = line[:cut]
        elif slip == 6:
            lines[at] = line.replace("mm", rng.choice(["km", "kg", "nm", "", "parsec"]))
        elif slip == 7:
            lines[at] = "".join(str(rng.randrange(10)) if c.isdigit() else c for c in line)
        else:
            other = rng.randrange(len(lines))
            lines[at], lines[other] = lines[other], lines[at]
    return "\n".join(lines) + "\n"
