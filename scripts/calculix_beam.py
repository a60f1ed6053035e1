#!/usr/bin/env python3
"""Writes the CalculiX deck of a free-free solid beam: quadratic bricks, no support.

    calculix_beam.py DECK.inp

The beam lies along x from 0 to 10 m, of square section 0.2 m, steel (E 200 GPa, density 7850 kg/m3,
Poisson's ratio 0 so that sections stay plane and the beam is that of Euler and Bernoulli but for
shear and rotary inertia). The twelve lowest modes: six rigid, then three pairs of bending.
"""

import sys

LENGTH, SIDE = 10.0, 0.2
ALONG, ACROSS = 80, 2
YOUNG, DENSITY, POISSON = 200e9, 7850.0, 0.0
MODES = 12


def main(path):
    # Nodes of a 20-node brick lie at corners and mid-edges of a grid of half elements.
    nodes = {}

    def node(i, j, k):
        return nodes.setdefault((i, j, k), len(nodes) + 1)

    # Corners of the near face, then of the far face, then mid-edges likewise, then edges between.
    corners = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
    edges = [(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)]
    between = [(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)]
    elements = []
    for a in range(ALONG):
        for b in range(ACROSS):
            for c in range(ACROSS):
                at = [(2 * a + i, 2 * b + j, 2 * c + k) for i, j, k in corners + edges + between]
                elements.append([node(*place) for place in at])
    lines = ["*NODE, NSET=ALL"]
    for (i, j, k), number in nodes.items():
        x = LENGTH * i / (2 * ALONG)
        y, z = (SIDE * (n / (2 * ACROSS) - 0.5) for n in (j, k))
        lines.append(f"{number}, {x:.9g}, {y:.9g}, {z:.9g}")
    lines.append("*ELEMENT, TYPE=C3D20R, ELSET=BEAM")
    for number, element in enumerate(elements, 1):
        lines.append(", ".join(map(str, [number, *element[:15]])) + ",")
        lines.append(", ".join(map(str, element[15:])))
    lines += [
        "*MATERIAL, NAME=STEEL",
        "*ELASTIC",
        f"{YOUNG:.6g}, {POISSON:.6g}",
        "*DENSITY",
        f"{DENSITY:.6g}",
        "*SOLID SECTION, ELSET=BEAM, MATERIAL=STEEL",
        "*STEP",
        "*FREQUENCY, SOLVER=SPOOLES",
        f"{MODES}",
        "*NODE FILE",
        "U",
        "*END STEP",
    ]
    with open(path, "w", encoding="ascii") as deck:
        deck.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
