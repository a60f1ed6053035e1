"""Models, poles and identities against an independent assembly in numpy."""

import shutil

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize

import oracle
from conftest import ROOT, run_file, tvse

EPSILON = np.finfo(float).eps

REPLAYED = [
    ("boosters", "nominal", 0),
    ("boosters", "dispersed", 0),
    ("boosters", "adverse", 0),
    ("boosters", "adverse_dispersed", 1),
    ("all_engines", "dispersed", 0),
    ("left_alone", "dispersed", 1),
    ("skewed", "nominal", 0),
    ("skewed", "dispersed", 0),
    ("skewed", "dispersed", 3),
]


@pytest.fixture(scope="module", params=REPLAYED, ids=lambda p: "-".join(map(str, p)))
def replayed(request, tmp_path_factory):
    """A run, a case of it, and its replay."""
    name, population, case = request.param
    run = request.getfixturevalue(name)
    return run, population, case, run.replay(population, case, tmp_path_factory.mktemp("replay") / "r")


def dense(entries, size):
    matrix = np.zeros((size, size))
    matrix[entries.row.astype(int), entries.column.astype(int)] = entries.value
    return matrix


def evaluations(tables, name):
    return tables[name].groupby(["flight_time_s", "variant"], observed=True)


def eigen(A):
    """Poles, right and left vectors, and the error that rounding may cause in each pole."""
    B, T = scipy.linalg.matrix_balance(A)
    poles, left, right = scipy.linalg.eig(B, left=True, right=True)
    condition = 1 / np.abs(np.einsum("ij,ij->j", left.conj(), right))
    # Backward error of the QR iteration: a modest multiple of n ε ‖B‖, twice (theirs and ours).
    error = 20 * len(A) * EPSILON * np.linalg.norm(B, 2) * condition
    return poles, T @ right, np.linalg.solve(T.T, left), error


def test_matrices_are_those_of_the_block_formulas(replayed):
    run, population, case, tables = replayed
    seen = 0
    for (time, variant), found in evaluations(tables, "matrices"):
        *expected, names = run.model(population, case, time, variant)
        for letter, matrix in zip("MDK", expected):
            entries = found[found.matrix == letter]
            assert [names[i] for i in entries.row.astype(int)] == list(entries.row_name)
            assert [names[i] for i in entries.column.astype(int)] == list(entries.column_name)
            difference = np.abs(dense(entries, len(names)) - matrix.value)
            # Some 30 roundings a term on either side.
            worst = np.unravel_index(np.argmax(difference - 60 * EPSILON * matrix.size), difference.shape)
            assert (difference <= 60 * EPSILON * matrix.size).all(), (
                f"{letter}[{names[worst[0]]}, {names[worst[1]]}] at {time} s, {variant}"
            )
            seen += 1
    assert seen == 3 * len(run.variants) * len(run.definition["flight_times_s"])


def test_the_mass_matrix_is_symmetric_and_positive_definite(replayed):
    for _, found in evaluations(replayed[3], "matrices"):
        entries = found[found.matrix == "M"]
        matrix = dense(entries, 1 + int(entries.row.max()))
        assert (matrix == matrix.T).all()
        np.linalg.cholesky(matrix)


def test_poles_are_those_of_lapack(replayed):
    run, population, case, tables = replayed
    for (time, variant), found in evaluations(tables, "poles"):
        M, D, K, names = run.model(population, case, time, variant)
        poles, _, _, error = eigen(oracle.state_matrix(M.value, D.value, K.value))
        ours = found.pole_re_rad_s.to_numpy() + 1j * found.pole_im_rad_s.to_numpy()
        assert len(ours) == (poles.imag >= 0).sum()
        # Each of ours has one of theirs, another one for each.
        rows, columns = scipy.optimize.linear_sum_assignment(np.abs(ours[:, None] - poles))
        assert (np.abs(ours[rows] - poles[columns]) <= error[columns]).all(), (time, variant)


def test_eigenvectors_satisfy_their_equations(replayed):
    _, _, _, tables = replayed
    vectors = dict(list(evaluations(tables, "vectors")))
    poles = dict(list(evaluations(tables, "poles")))
    for at, found in evaluations(tables, "matrices"):
        entries = found[found.matrix == "A"]
        states = 1 + int(entries.row.max())
        A = dense(entries, states)
        table = vectors[at].sort_values("pole", kind="stable")
        part = lambda side: (table[f"{side}_re"] + 1j * table[f"{side}_im"]).to_numpy().reshape(-1, states).T
        v, w = part("right"), part("left")
        s = (poles[at].pole_re_rad_s + 1j * poles[at].pole_im_rad_s).to_numpy()
        # Backward error: the residual against the size of the terms, column by column.
        limit = 1e3 * states * EPSILON
        for residual, size in [
            (A @ v - v * s, np.abs(A) @ np.abs(v) + np.abs(v * s)),
            (A.T @ w.conj() - w.conj() * s, np.abs(A.T) @ np.abs(w) + np.abs(w * s)),
        ]:
            norms = np.linalg.norm(residual, axis=0) / np.linalg.norm(size, axis=0)
            assert (norms <= limit).all(), (at, norms.max())
        scale = np.einsum("ij,ij->j", w.conj(), v)
        assert np.abs(scale - 1).max() <= limit * np.abs(w).max() * np.abs(v).max()


@pytest.mark.parametrize("how", ["gates", "absolute", "links"])
def test_a_run_is_replayed_from_its_copies_however_it_names_its_inputs(how, tmp_path):
    home = tmp_path / "home"
    shutil.copytree(ROOT / "vehicles", home / "vehicles")
    shutil.copytree(ROOT / "dispersions", home / "dispersions")
    above, more = "..", ""
    if how == "gates":
        shutil.copy(ROOT / "runs/reference.gates.toml", home)
        more = 'gates = "../reference.gates.toml"\n'
    elif how == "absolute":
        above = home
    else:
        (tmp_path / "links").mkdir()
        for name in ["vehicles", "dispersions"]:
            (tmp_path / "links" / name).symlink_to(home / name)
        home = tmp_path / "links"
    (home / "runs").mkdir(exist_ok=True)
    text = more + run_file(
        f"{above}/vehicles/sls-like", f"{above}/dispersions/reference.toml", 1, [110.0], ["booster.*"], ["case_only"]
    )
    (home / "runs/this.toml").write_text(text)
    # Links lead out of the folder of the study, which takes a flag.
    outside = ["--allow-outside"] if how == "links" else []
    tvse("run", home / "runs/this.toml", "-o", tmp_path / "run", *outside)
    # The originals are gone: what counts is in the run's folder.
    shutil.rmtree(tmp_path / "home")
    assert "bit for bit" in tvse("replay", tmp_path / "run", "--case", 0)


# ---------------------------------------------------------------- identity


def label_of(run, time):
    present = run.vehicle.package.at(time)[0]
    return next(l for l in run.vehicle.file["named_mode"][0]["labels"] if l in present)


def participation(names, label, left, right):
    """Share of a label's coordinate and its rate in every pole."""
    at = names.index(f"eta.{label}")
    both = [at, at + len(names)]
    total = np.einsum("ij,ij->j", left.conj(), right)
    return np.abs(np.einsum("ij,ij->j", left[both].conj(), right[both]) / total)


def by_participation(model, label):
    M, D, K, names = model
    poles, right, left, error = eigen(oracle.state_matrix(M.value, D.value, K.value))
    share = np.where(poles.imag > 0, participation(names, label, left, right), 0)
    return poles[share.argmax()], share.max(), error[share.argmax()]


def continued(path, label, steps):
    """The pole of a label followed from path(0), where it is by participation, to path(1)."""
    vector = None
    for t in np.linspace(0, 1, steps + 1):
        M, D, K, names = path(t)
        poles, right, left, _ = eigen(oracle.state_matrix(M.value, D.value, K.value))
        if vector is None:
            share = participation(names, label, left, right)
        else:
            share = np.abs(vector.conj() @ right) / np.linalg.norm(right, axis=0)
        chosen = np.where(poles.imag > 0, share, 0).argmax()
        vector = right[:, chosen] / np.linalg.norm(right[:, chosen])
    return poles[chosen]


def stored(run, population):
    rows = run.table("modes")
    return rows[(rows.population == population) & (rows["mode"] == "tvse")]


def pole(row):
    return row.pole_re_rad_s + 1j * row.pole_im_rad_s


@pytest.mark.parametrize("variant", ["no_jet_damping", "jet_damping", "thrust_off"])
def test_the_nominal_pole_is_reached_by_continuation(boosters, variant):
    for row in stored(boosters, "nominal").query("variant == @variant").itertuples():
        def path(t):
            # Engine mass first, then thrust and flow.
            factors = dict(coupling=min(2 * t, 1), push=max(2 * t - 1, 0))
            return boosters.model("nominal", 0, row.flight_time_s, variant, **factors)

        found = continued(path, row.label, 24)
        assert abs(found - pole(row)) < 1e-9 * abs(found), (row.flight_time_s, found, pole(row))


def interpolated(run, population, case, time, variant):
    """The vehicle on the way from the nominal draws to those of a case."""
    row = run.cases.loc[(population, case)]

    def path(t):
        values = {}
        for key, column in run.columns.items():
            # A draw at t = 0 leaves the nominal value: 1 as a factor, 0 as a difference; what is
            # absolute starts from the nominal of the parameter.
            start = {"scale": 1.0, "offset": 0.0}
            if key in run.draws:
                apply = run.draws[key].row["apply"]
                nominal = start.get(apply, absolute_nominal(run, run.draws[key].targets[0]))
                values[key] = nominal + t * (row[column] - nominal)
        case_at = oracle.Case(run.draws, values)
        return oracle.assemble(run.vehicle, time, run.variants[variant], run.gimballed, case_at)

    return path


def absolute_nominal(run, path):
    return {"damping": run.vehicle.file["structure"]["damping_ratio"]}.get(path.split(".")[-1], 1.0)


def test_the_named_pole_of_a_case_is_the_one_its_label_takes_part_in_most(smoke):
    followed = 0
    for row in stored(smoke, "dispersed").query("branch == 'primary'").itertuples():
        at = ("dispersed", row.case, row.flight_time_s, row.variant)
        label = label_of(smoke, row.flight_time_s)
        assert row.label == label
        found, share, error = by_participation(smoke.model(*at), label)
        if abs(found - pole(row)) > error:
            # Bending and actuator exchange character: the way from the nominal decides.
            found = continued(interpolated(smoke, *at), label, 40)
            assert abs(found - pole(row)) < 1e-9 * abs(found), at
            followed += 1
    assert followed <= 5


@pytest.mark.parametrize("name", ["boosters", "all_engines", "left_alone", "skewed"])
def test_every_stored_row_is_a_pole_of_its_model(name, request):
    run = request.getfixturevalue(name)
    rows = run.table("modes")
    assert (rows.status == "ok").all()
    differing = 0
    for (population, case, variant, time), found in rows.groupby(
        ["population", "case", "variant", "flight_time_s"], observed=True
    ):
        M, D, K, names = run.model(population, case, time, variant)
        poles, right, left, error = eigen(oracle.state_matrix(M.value, D.value, K.value))
        label = label_of(run, time)
        shares = participation(names, label, left, right)
        for row in found.itertuples():
            nearest = np.abs(poles - pole(row)).argmin()
            assert abs(poles[nearest] - pole(row)) <= error[nearest]
            assert abs(row.damping_ratio + pole(row).real / abs(pole(row))) < 4 * EPSILON
            assert abs(row.frequency_hz * 2 * np.pi - pole(row).imag) < 4 * EPSILON * pole(row).imag
            doubling = np.log(2) / pole(row).real if pole(row).real > 0 else np.nan
            assert np.isclose(row.time_to_double_s, doubling, rtol=4 * EPSILON, equal_nan=True)
            if row.branch == "primary":
                differing += shares[nearest] < np.where(poles.imag > 0, shares, 0).max()
    assert differing <= 0.1 * len(rows)


def test_participations_are_those_of_the_state_vectors(smoke):
    rows = stored(smoke, "dispersed").query("branch == 'primary'").head(8)
    for row in rows.itertuples():
        M, D, K, names = smoke.model("dispersed", row.case, row.flight_time_s, row.variant)
        poles, right, left, _ = eigen(oracle.state_matrix(M.value, D.value, K.value))
        k = np.abs(poles - pole(row)).argmin()
        factors = left[:, k].conj() * right[:, k] / (left[:, k].conj() @ right[:, k])
        factors = factors[: len(names)] + factors[len(names) :]
        elastic = np.array([n.startswith("eta.") for n in names])
        assert abs(factors[elastic].sum().real - row.participation_structure) < 1e-9
        assert abs(factors[~elastic].sum().real - row.participation_nozzle) < 1e-9


# ---------------------------------------------------------------- corner


def test_a_corner_stands_at_the_side_that_lowers_the_damping(boosters):
    times = boosters.definition["flight_times_s"]
    population = next(p for p in boosters.definition["populations"] if p["name"] == "adverse")
    keys = list(boosters.columns)
    assert len(population["fixed"]) > 20
    for index, value in population["fixed"]:
        key = keys[index]
        worst = boosters.draws[key].row["worst"]
        assert value in worst

        def least(value):
            case = oracle.Case(boosters.draws, {key: value})
            damping = []
            for time in times:
                model = oracle.assemble(
                    boosters.vehicle, time, boosters.variants["jet_damping"], boosters.gimballed, case
                )
                s, _, _ = by_participation(model, label_of(boosters, time))
                damping.append(-s.real / abs(s))
            return min(damping)

        chosen, other = least(value), least(sum(worst) - value)
        # Keys without effect stand wherever rounding puts them.
        assert chosen <= other + 1e-12, (key, value, chosen, other)
        stored_value = boosters.cases.loc[("adverse", 0), boosters.columns[key]]
        assert stored_value == value
    drawn = boosters.cases.loc[("adverse_dispersed", slice(None)), :]
    for index, value in population["fixed"]:
        assert (drawn[boosters.columns[keys[index]]] == value).all()


# ---------------------------------------------------------------- what variants mean


def test_with_thrust_off_flow_and_acceleration_are_off_too(boosters):
    of = lambda variant: boosters.model("dispersed", 0, 112.0, variant)
    off, none = of("thrust_off"), of("no_jet_damping")
    assert (off[1].value == none[1].value).all(), "no jet damping without flow"
    assert (off[2].value == off[2].value.T).all(), "a conservative stiffness"
    assert (off[0].value == none[0].value).all()


def test_thrust_destabilises_and_jet_damping_stabilises_the_nominal(boosters):
    damping = stored(boosters, "nominal").set_index(["flight_time_s", "variant"]).damping_ratio
    for time in boosters.definition["flight_times_s"]:
        at = damping[time]
        assert at["no_jet_damping"] < at["case_only"] < at["jet_damping"] < at["thrust_off"]
