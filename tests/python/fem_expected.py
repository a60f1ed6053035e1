"""Writes what pyNastran reads from the real result files to tests/data/fem/expected, for the test
tests/fem/real.rs, in the columns of the plain tables.

    python tests/python/fem_expected.py ../shared/data/fem

Needs pyNastran, h5py and numpy. Frequencies are cycles with the sign of the eigenvalue. Of long
results the shapes of some modes only.
"""

import sys
from pathlib import Path

import h5py
import numpy as np
from pyNastran.op2.op2_geom import read_op2_geom

OUT = Path(__file__).parent.parent / "data" / "fem" / "expected"


def write(name, header, rows):
    with open(OUT / name, "w") as file:
        file.write(header + "\n")
        for row in rows:
            file.write(",".join(repr(x) if isinstance(x, float) else str(x) for x in row) + "\n")



def op2(path, name, some=None):
    model = read_op2_geom(path, debug=None, xref=False, mode="nx")
    grids = [g for g in model.nodes.values() if g.cd >= 0]
    rows = [(g.nid, *(float(x) for x in g.xyz), g.cp, g.cd) for g in grids]
    write(f"{name}_nodes.csv", "node,x,y,z,position_system,displacement_system", rows)
    (vectors,) = model.eigenvectors.values()
    if model.eigenvalues:
        # The last of several tables that pyNastran keeps under one title.
        table = list(model.eigenvalues.values())[-1]
        lines = zip(table.mode, table.eigenvalues, table.cycles, table.generalized_mass)
        rows = [(int(m), float(np.copysign(c, e)), float(g)) for m, e, c, g in lines]
        write(f"{name}_summary.csv", "mode,frequency_hz,generalised_mass", rows)
    rows = []
    for k, mode in enumerate(vectors.modes):
        if some is not None and int(mode) not in some:
            continue
        for (node, kind), u in zip(vectors.node_gridtype, vectors.data[k]):
            if kind == 1:
                assert np.all(np.imag(u) == 0)
                rows.append((int(mode), 0, int(node), *(float(x) for x in np.real(u))))
    write(f"{name}_modes.csv", "mode,frequency_hz,node,tx,ty,tz,rx,ry,rz", rows)


def hdf5(path, name):
    with h5py.File(path) as file:
        nastran = file["NASTRAN"]
        grids = nastran["INPUT/NODE/GRID"][:]
        rows = [(g["ID"], *(float(x) for x in g["X"]), g["CP"], g["CD"]) for g in grids]
        write(f"{name}_nodes.csv", "node,x,y,z,position_system,displacement_system", rows)
        modes = {d["ID"]: d["MODE"] for d in nastran["RESULT/DOMAINS"][:]}
        rows = []
        ids = set(grids["ID"])
        for line in nastran["RESULT/NODAL/EIGENVECTOR"][:]:
            if line["ID"] in ids:
                u = (float(line[c]) for c in ("X", "Y", "Z", "RX", "RY", "RZ"))
                rows.append((modes[line["DOMAIN_ID"]], 0, line["ID"], *u))
        write(f"{name}_modes.csv", "mode,frequency_hz,node,tx,ty,tz,rx,ry,rz", rows)


if __name__ == "__main__":
    data = Path(sys.argv[1])
    OUT.mkdir(parents=True, exist_ok=True)
    op2(data / "pyyeti" / "full.op2", "full", some=(1, 7, 10, 278))
    op2(data / "pynastran" / "modes_elements.op2", "modes_elements_op2")
    hdf5(data / "pynastran" / "modes_elements.h5", "modes_elements_h5")
    op2(data / "pynastran" / "beam_modes_m1.op2", "beam_modes_m1")
    op2(data / "pynastran" / "beam_modes_m2.op2", "beam_modes_m2")
    op2(data / "pynastran" / "fsi.op2", "fsi")
