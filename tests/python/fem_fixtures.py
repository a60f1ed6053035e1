"""Writes the small result files in tests/data/fem: one model of six grids and three modes in every
format, and files that the readers must refuse.

    python tests/python/fem_fixtures.py

Needs h5py and numpy. Shapes are multiples of 1/64 below one: all formats hold them exactly. The
writers follow the format descriptions that the readers in src/fem/format name.
"""

import struct
from math import pi
from pathlib import Path

import h5py
import numpy as np

FOLDER = Path(__file__).parent.parent / "data" / "fem"

# id: (position system, position, displacement system)
GRIDS = {
    1: (0, (0.0, 0.0, 0.0), 0),
    2: (0, (0.0, 0.0, 2.0), 0),
    3: (0, (4.0, 0.0, 0.0), 30),
    14: (10, (1.5, 90.0, 3.0), 10),
    15: (20, (0.5, -0.25, 8.0), 20),
    100006: (0, (-7.5, 1.25, 0.125), 0),
}
CYLINDRICAL, NESTED, BY_GRIDS = 10, 20, 30
CORD2 = {
    CYLINDRICAL: (2, 0, (1.0, 2.0, 3.0, 1.0, 2.0, 4.0, 2.0, 2.0, 3.0)),
    NESTED: (1, 10, (2.0, 45.0, 1.0, 2.0, 45.0, 2.0, 3.0, 45.0, 1.0)),
}
CORD1 = {BY_GRIDS: (1, (1, 2, 3))}
KINDS = {1: "R", 2: "C", 3: "S"}
MODES = {1: (5.0, 1.0), 2: (12.5, 0.25), 3: (40.0, 2.0)}


def shape(mode, index):
    return [((7 * mode + 11 * index + 5 * k * mode) % 127 - 63) / 64 for k in range(6)]


SHAPES = {m: {g: shape(m, i) for i, g in enumerate(GRIDS)} for m in MODES}


def eigenvalue(mode):
    return (2 * pi * MODES[mode][0]) ** 2


# ---- tables


def tables():
    with open(FOLDER / "nodes.csv", "w") as file:
        file.write("node,x,y,z,position_system,displacement_system,label\n")
        for g, (cp, x, cd) in GRIDS.items():
            label = {1: "gimbal", 3: "sensor"}.get(g, "")
            file.write(f"{g},{x[0]},{x[1]},{x[2]},{cp},{cd},{label}\n")
    with open(FOLDER / "modes.csv", "w") as file:
        file.write("mode,frequency_hz,generalised_mass,node,tx,ty,tz,rx,ry,rz\n")
        for m, (f, mass) in MODES.items():
            for g, u in SHAPES[m].items():
                file.write(f"{m},{f},{mass},{g}," + ",".join(str(x) for x in u) + "\n")
    with open(FOLDER / "systems.csv", "w") as file:
        file.write("system,kind,reference,ax,ay,az,bx,by,bz,cx,cy,cz\n")
        names = {1: "rectangular", 2: "cylindrical", 3: "spherical"}
        for c, (kind, reference, points) in CORD2.items():
            numbers = ",".join(str(x) for x in points)
            file.write(f"{c},{names[kind]},{reference},{numbers}\n")
    with open(FOLDER / "masses.csv", "w") as file:
        file.write("node,mass,ixx,iyy,izz\n")
        for g in GRIDS:
            file.write(f"{g},{0.5 * g},1,2,3\n")


# ---- deck and punch


def deck():
    lines = ["SOL 103", "CEND", "BEGIN BULK", "$ one model, three kinds of fields"]
    for g, (cp, x, cd) in GRIDS.items():
        if g == 14:
            lines.append(f"{'GRID*':8}{g:16}{cp:16}{x[0]:16}{x[1]:16}")
            lines.append(f"{'*':8}{x[2]:16}{cd:16}")
        elif g == 15:
            lines.append(f"GRID,{g},{cp},5.-1,-.25,8.+0,{cd} $ free field")
        else:
            lines.append(f"{'GRID':8}{g:8}{cp or '':8}{x[0]:8}{x[1]:8}{x[2]:8}{cd or '':8}")
    for c, (kind, reference, p) in CORD2.items():
        fields = "".join(f"{x:8}" for x in p[:6])
        lines.append(f"{'CORD2' + KINDS[kind]:8}{c:8}{reference:8}{fields}")
        lines.append(f"{'':8}" + "".join(f"{x:8}" for x in p[6:]))
    for c, (kind, g) in CORD1.items():
        lines.append(f"cord1{KINDS[kind].lower()},{c}," + ",".join(str(x) for x in g))
    lines.append("ENDDATA")
    (FOLDER / "model.bdf").write_text("\n".join(lines) + "\n")


def punch(name, imaginary=None, title=""):
    number = 0
    lines = []

    def line(text):
        nonlocal number
        number += 1
        lines.append(f"{text:72}{number:8}")

    for m in MODES:
        line("$TITLE   =")
        line(f"$SUBTITLE={title}")
        line("$LABEL   =")
        line("$EIGENVECTOR")
        line("$REAL OUTPUT" if imaginary is None else "$REAL-IMAGINARY OUTPUT")
        line("$SUBCASE ID =           1")
        if imaginary is None:
            line(f"$EIGENVALUE =  {eigenvalue(m):.7E}  MODE = {m:5}")
        else:
            line(f"$EIGENVALUE = (  {0:.7E},  {2 * pi * MODES[m][0]:.7E}) MODE = {m:5}")
        for g, u in SHAPES[m].items():
            u = u if imaginary is None else u + [imaginary] * 6
            for k in range(0, len(u), 3):
                head = f"{g:10}{'G':>8}" if k == 0 else f"{'-CONT-':18}"
                line(head + "".join(f"{x:18.6E}" for x in u[k : k + 3]))
        line(f"{9001:10}{'S':>8}" + f"{1.0:18.6E}{0.0:18.6E}{0.0:18.6E}")
        line(f"{'-CONT-':18}" + f"{0.0:18.6E}" * 3)
    (FOLDER / name).write_text("\n".join(lines) + "\n")


# ---- OP2


class Op2:
    def __init__(self, name, big=False, size=4, label=True):
        self.order = ">" if big else "<"
        self.size = size
        self.file = open(FOLDER / name, "wb")
        if label:
            self.key(3)
            self.block(self.ints(7, 10, 17))
            self.key(7)
            self.block(self.text("NASTRAN FORT TAPE ID CODE - "))
            self.key(2)
            self.block(self.text("OWN1.0  "))
            self.key(-1)
            self.key(0)

    def ints(self, *values):
        return struct.pack(f"{self.order}{len(values)}{'i' if self.size == 4 else 'q'}", *values)

    def reals(self, *values):
        return struct.pack(f"{self.order}{len(values)}{'f' if self.size == 4 else 'd'}", *values)

    def text(self, text):
        pad = b"" if self.size == 4 else b"    "
        return b"".join(text[k : k + 4].encode() + pad for k in range(0, len(text), 4))

    def block(self, data):
        length = struct.pack(self.order + "i", len(data))
        self.file.write(length + data + length)

    def key(self, key):
        self.block(self.ints(key))

    def close(self):
        self.key(0)
        self.file.close()

    def matrix(self, name, columns):
        self.key(2)
        self.block(self.text(f"{name:8}"))
        self.key(-1)
        self.key(7)
        self.block(self.ints(101, len(columns), len(columns), 1, 1, 1, 1))
        header = self.text(f"{name:8}")
        self.start(-2, 0)
        self.key(2)
        self.block(header)
        for k, column in enumerate(columns):
            self.start(-3 - k, 1)
            # The key counts the numbers; their row stands in front of them.
            self.key(len(column))
            self.block(self.ints(1) + self.reals(*column))
        self.start(-3 - len(columns), 0)
        self.key(0)

    def start(self, number, kind):
        self.key(number)
        self.key(1)
        self.key(kind)

    def table(self, name, records, pieces=1):
        self.key(2)
        self.block(self.text(f"{name:8}"))
        self.key(-1)
        self.key(7)
        self.block(self.ints(101, 0, 0, 0, 0, 0, 0))
        number = -2
        for record in [self.text(f"{name:8}"), *records]:
            self.start(number, 0)
            words = len(record) // self.size
            step = max(1, -(-words // pieces))
            for k in range(0, words, step):
                piece = record[k * self.size : (k + step) * self.size]
                self.key(len(piece) // self.size)
                self.block(piece)
            number -= 1
        self.start(number, 0)
        self.key(0)

    def ident(self, approach, table, subcase, mode, first, second, form, width, title, flag=0):
        words = self.ints(approach * 10 + 1, table, 0, subcase, mode)
        words += self.reals(first, second)
        words += self.ints(0, form, width, flag) + self.ints(*[0] * 39)
        titles = f"{'OWN MODEL':128}{title:128}{'SUBCASE 1':128}"
        return words + self.text(titles)

    def geometry(self):
        grids = self.ints(4501, 45, 1)
        for g, (cp, x, cd) in GRIDS.items():
            grids += self.ints(g, cp) + self.reals(*x) + self.ints(cd, 0, 0)
        keys = {1: (2101, 21, 8), 2: (2001, 20, 9)}
        records = []
        for c, (kind, reference, points) in CORD2.items():
            head = self.ints(*keys[kind], c, kind, 2, reference)
            records.append(head + self.reals(*points))
        for c, (kind, g) in CORD1.items():
            records.append(self.ints(1801, 18, 5, c, kind, 1, *g))
        records.append(grids)
        records.append(self.ints(65535, 65535, 65535))
        self.table("GEOM1S", records, pieces=2)

    def summary(self, flag=0):
        data = b""
        for m, (f, mass) in MODES.items():
            numbers = (eigenvalue(m), 2 * pi * f, f, mass, mass * eigenvalue(m))
            data += self.ints(m, m) + self.reals(*numbers)
        ident = self.ints(21, 6, 0, 0, 0, 0, 0, 0, 0, 7, flag) + self.ints(*[0] * 39)
        self.table("LAMA", [ident + self.text(" " * 384), data])

    def shapes(self, name="OUGV1", title="", imaginary=None, sort=0, subcases=(1,)):
        records = []
        for subcase in subcases:
            for m in MODES:
                if imaginary is None:
                    numbers = (2, 7 + 1000 * sort, subcase, m, eigenvalue(m), MODES[m][0], 1, 8)
                else:
                    numbers = (9, 1007, subcase, m, 0.0, 2 * pi * MODES[m][0], 2, 14)
                records.append(self.ident(*numbers, title))
                data = b""
                for g, u in SHAPES[m].items():
                    u = u if imaginary is None else u + [imaginary] * 6
                    data += self.ints(g * 10 + 1, 1) + self.reals(*u)
                u = [1.0] + [0.0] * (5 if imaginary is None else 11)
                data += self.ints(90011, 2) + self.reals(*u)
                records.append(data)
        self.table(name, records, pieces=2)


def op2():
    for big in (False, True):
        for size in (4, 8):
            order = "big" if big else "little"
            file = Op2(f"model_{order}_{8 * size}.op2", big, size, label=not big)
            file.geometry()
            file.summary()
            file.matrix("KHH", [(1.0, 2.0), (3.0, 4.0)])
            file.shapes()
            file.close()
    variants = {
        "basic": dict(name="BOUGV1"),
        "undamped": dict(imaginary=0.0),
        "complex": dict(imaginary=0.5),
        "superelement": dict(title="SUPERELEMENT        12"),
        "sort2": dict(sort=2),
        "two_subcases": dict(subcases=(1, 2)),
    }
    for variant, options in variants.items():
        file = Op2(f"{variant}.op2")
        file.geometry()
        file.summary(flag=2 if variant == "basic" else 0)
        file.shapes(**options)
        file.close()


# ---- HDF5


def table(group, name, fields, rows, chunk=16):
    data = np.array(rows, dtype=fields)
    group.create_dataset(name, data=data, chunks=(chunk,), maxshape=(None,), compression="gzip")


def hdf5(name, superelement=0, imaginary=0.0, residual=0, cplx=False):
    with h5py.File(FOLDER / name, "w", libver=("earliest", "v108")) as file:
        node = file.create_group("NASTRAN/INPUT/NODE")
        i, f = "<i8", "<f8"
        fields = [("ID", i), ("CP", i), ("X", f, (3,)), ("CD", i), ("PS", i), ("SEID", i)]
        fields.append(("DOMAIN_ID", i))
        rows = [(g, cp, x, cd, 0, 0, 1) for g, (cp, x, cd) in GRIDS.items()]
        table(node, "GRID", fields, rows)
        system = file.create_group("NASTRAN/INPUT/COORDINATE_SYSTEM")
        corners = [(f"{p}{k}", f) for p in "ABC" for k in (1, 2, 3)]
        for c, (kind, reference, points) in CORD2.items():
            fields = [("CID", i), ("RID", i), *corners, ("DOMAIN_ID", i)]
            table(system, f"CORD2{KINDS[kind]}", fields, [(c, reference, *points, 1)])
        for c, (kind, g) in CORD1.items():
            fields = [("CID", i), ("G1", i), ("G2", i), ("G3", i), ("DOMAIN_ID", i)]
            table(system, f"CORD1{KINDS[kind]}", fields, [(c, *g, 1)])
        result = file.create_group("NASTRAN/RESULT")
        names = "ID SUBCASE STEP ANALYSIS TIME_FREQ_EIGR EIGI MODE DESIGN_CYCLE RANDOM SE".split()
        fields = [(n, f if n in ("TIME_FREQ_EIGR", "EIGI") else i) for n in names]
        rows = [
            (m + 3, 1, 0, 2, eigenvalue(m), imaginary, m, 0, 0, superelement) for m in MODES
        ]
        table(result, "DOMAINS", fields, rows)
        summary = result.create_group("SUMMARY")
        names = "MODE ORDER EIGEN OMEGA FREQ MASS STIFF RESFLG FLDFLG DOMAIN_ID".split()
        fields = [(n, f if n in "EIGEN OMEGA FREQ MASS STIFF".split() else i) for n in names]
        rows = [
            (m, m, eigenvalue(m), 2 * pi * v, v, mass, mass * eigenvalue(m), residual, 0, m)
            for m, (v, mass) in MODES.items()
        ]
        table(summary, "EIGENVALUE", fields, rows)
        nodal = result.create_group("NODAL")
        fields = [("ID", i), *[(n, f) for n in "X Y Z RX RY RZ".split()], ("DOMAIN_ID", i)]
        rows = [(g, *u, m + 3) for m in MODES for g, u in SHAPES[m].items()]
        rows += [(9001, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, m + 3) for m in MODES]
        table(nodal, "EIGENVECTOR_CPLX" if cplx else "EIGENVECTOR", fields, rows, chunk=7)


# ---- universal files


def basic_axes():
    """Origin and axes of the systems in the basic frame, by hand: all are turned about z only."""
    cylinder = (np.array([1.0, 2.0, 3.0]), np.eye(3))
    # Point (2, 45°, 1) of the cylinder; its x axis points from there along the radius.
    c = np.cos(pi / 4)
    nested = (np.array([1.0 + 2 * c, 2.0 + 2 * c, 4.0]), [[c, c, 0], [-c, c, 0], [0, 0, 1]])
    by_grids = (np.zeros(3), np.eye(3))
    return {CYLINDRICAL: (1, *cylinder), NESTED: (0, *nested), BY_GRIDS: (0, *by_grids)}


def dataset(number, lines):
    return ["    -1", f"{number:6}", *lines, "    -1"]


def universal(name, modern):
    def reals(values, double):
        width, text = (3, "25.16E") if double else (6, "13.5E")
        lines = [values[k : k + width] for k in range(0, len(values), width)]
        lines = ["".join(f"{x:{text}}" for x in line) for line in lines]
        return [line.replace("E", "D") if double else line for line in lines]

    lines = dataset(151, ["model", "description", "program"])
    factors = "".join(f"{x:25.16E}" for x in (1.0, 1.0, 1.0)).replace("E", "D")
    lines += dataset(164, [f"{1:10}{'SI: Meter (newton)':20}{2:10}", factors, f"{273.15:25.16E}"])
    ids = ["one", "two", "three", "four", "five"]
    if modern:
        systems = ["         1", "part"]
        for c, (kind, origin, axes) in basic_axes().items():
            systems += [f"{c:10}{kind:10}{0:10}", f"CS{c}"]
            for row in [*axes, origin]:
                systems += reals(list(row), True)
        lines += dataset(2420, systems)
        nodes = []
        for g, (cp, x, cd) in GRIDS.items():
            nodes += [f"{g:10}{1:10}{cd:10}{11:10}", *reals(list(x), True)]
        lines += dataset(2411, nodes)
        group = [f"{1:10}" + f"{0:10}" * 6 + f"{3:10}", "gimbal"]
        group += [f"{7:10}{1:10}{0:10}{0:10}{8:10}{5:10}{0:10}{0:10}", f"{7:10}{14:10}{0:10}{0:10}"]
        lines += dataset(2467, group)
        for m, (f, mass) in MODES.items():
            body = [f"{m:10}", f"mode {m}", f"{1:10}", *ids]
            body += ["".join(f"{k:10}" for k in (1, 2, 3, 8, 4, 6))]
            body += ["".join(f"{k:10}" for k in (0, 0, 1, 0, 1, m, 0, 0))]
            body += [f"{0:10}{0:10}"]
            body += reals([0.0, f, eigenvalue(m), mass, 0.01, 0.0], False)
            body += reals([0.0] * 6, False)
            for g, u in SHAPES[m].items():
                body += [f"{g:10}", *reals(u, True)]
            lines += dataset(2414, body)
    else:
        systems = []
        for c, (kind, origin, axes) in basic_axes().items():
            axes = np.array(axes)
            points = [*origin, *(origin + 2 * axes[0]), *(origin + axes[0] + 3 * axes[2])]
            systems += [f"{c:10}{kind:10}{0:10}{8:10}{1:10}", f"CS{c}", *reals(points, False)]
        lines += dataset(18, systems)
        nodes = []
        for g, (cp, x, cd) in GRIDS.items():
            nodes.append(f"{g:10}{cp:10}{cd:10}{11:10}" + reals(list(x), False)[0])
        lines += dataset(15, nodes)
        for m, (f, mass) in MODES.items():
            body = [*ids, "".join(f"{k:10}" for k in (1, 2, 3, 8, 2, 6))]
            body += ["".join(f"{k:10}" for k in (2, 4, 1, m))]
            body += reals([f, mass, 0.01, 0.0], False)
            for g, u in SHAPES[m].items():
                body += [f"{g:10}", *reals(u, False)]
            lines += dataset(55, body)
    (FOLDER / name).write_text("\n".join(lines) + "\n")


# ---- CalculiX


def frd(name, coding):
    """Coding 0 and 1 short and long text; 3 binary doubles for nodes and floats for results."""
    out = open(FOLDER / name, "wb")

    def line(text):
        out.write(text.encode() + b"\n")

    def entries(rows, code):
        for g, u in rows:
            if code in (0, 1):
                line(f" -1{g:{5 if code == 0 else 10}}" + "".join(f"{x:12.5E}" for x in u))
            else:
                out.write(struct.pack(f"<i{len(u)}{'f' if code == 2 else 'd'}", g, *u))
        if code in (0, 1):
            line(" -3")

    results = 2 if coding == 3 else coding
    # The short form has room for five digits only.
    ids = {g: g % 1000 if coding == 0 else g for g in GRIDS}
    line("    1Cown model")
    line("    1UPGM               own writer")
    line(f"    2C{'':18}{len(GRIDS):12}{'':37}{coding}")
    entries([(ids[g], x) for g, (_, x, _) in GRIDS.items()], coding)
    line(f"    3C{'':18}{1:12}{'':37}{results}")
    if results == 2:
        out.write(struct.pack("<6i", 1, 11, 0, 1, 1, 2))
    else:
        line(f" -1{1:10}{11:5}{0:5}{1:5}")
        line(f" -2{1:10}{2:10}")
        line(" -3")
    static = "".join(f" -5  {n:8}{1:5}{2:5}{k:5}{0:5}\n" for k, n in enumerate("D1 D2 D3".split(), 1))
    for m in [0, *MODES]:
        f, mass = MODES.get(m, (0.0, 0.0))
        line(f"    1PSTEP{m + 1:26}{1:12}{1:12}")
        if m:
            line(f"    1PGM{mass:24.6E}")
            line(f"    1PGK{mass * eigenvalue(m):24.6E}")
            line(f"    1PHID{-1:27}")
            line(f"    1PSUBC{0:26}")
            line(f"    1PMODE{m:26}")
        kind = "MODAL" if m else ""
        line(f"  100CL{101 + m:5}{f:12.5E}{len(GRIDS):12}{'':20}{2 if m else 0:2}{m:5}{kind:10}{results:2}")
        line(f" -4  {'DISP':8}{4:5}{1:5}")
        out.write(static.encode())
        line(f" -5  {'ALL':8}{1:5}{2:5}{0:5}{0:5}{1:5}ALL")
        u = SHAPES[m or 1]
        entries([(ids[g], u[g][:3]) for g in GRIDS], results)
        line(f"  100CL{101 + m:5}{f:12.5E}{len(GRIDS):12}{'':20}{2 if m else 0:2}{m:5}{kind:10}{results:2}")
        line(f" -4  {'STRESS':8}{6:5}{1:5}")
        for k, n in enumerate("SXX SYY SZZ SXY SYZ SZX".split()):
            line(f" -5  {n:8}{1:5}{4:5}{k:5}{k:5}")
        entries([(ids[g], [1.0] * 6) for g in GRIDS], results)
    line(" 9999")
    out.close()


if __name__ == "__main__":
    FOLDER.mkdir(parents=True, exist_ok=True)
    tables()
    deck()
    punch("model.pch")
    punch("undamped.pch", imaginary=0.0)
    punch("complex.pch", imaginary=0.5)
    punch("superelement.pch", title="SUPERELEMENT        12")
    op2()
    hdf5("model.h5")
    hdf5("superelement.h5", superelement=12)
    hdf5("complex.h5", cplx=True)
    hdf5("residual.h5", residual=2)
    universal("model_55.unv", modern=False)
    universal("model_2414.unv", modern=True)
    for coding in (0, 1, 3):
        frd(f"model_{coding}.frd", coding)
