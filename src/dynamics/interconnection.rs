//! Interconnection of named blocks to one system.
//!
//! An input of a block reads the signal of its name: the sum of all outputs of that name and of the
//! external input of that name. Names are resolved once; composing works on numbers alone. What the
//! blocks are is known to `servo`.

use crate::spelling::allowed_instead;
use crate::vehicle::StateSpace;
use nalgebra::{Complex, DMatrix};
use std::ops::Range;

/// Names of a block's ports and states.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Block {
    /// Name, for messages.
    pub name: String,
    /// Signals it reads.
    pub inputs: Vec<String>,
    /// Signals to which it adds.
    pub outputs: Vec<String>,
    /// States.
    pub states: Vec<String>,
}

/// A port that reads a signal which nothing makes.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{reader} reads the signal \"{signal}\"; allowed: {allowed}")]
pub struct Unknown {
    /// Block that reads it.
    pub reader: String,
    /// Name of the signal.
    pub signal: String,
    /// Signals that exist.
    pub allowed: String,
}

/// An algebraic loop that has no solution, or none worth the name.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("algebraic loop through {}: condition number {condition:.1e}", .ports.join(", "))]
pub struct AlgebraicLoop {
    /// Output ports in the loop, as `block: signal`.
    pub ports: Vec<String>,
    /// Condition number of 1 − D K in the loop, balanced.
    pub condition: f64,
}

/// Condition number beyond which half of the digits of a loop's signals would be lost.
const LARGEST_CONDITION: f64 = 6.7e7; // 1/√ε

/// What a port reads: outputs, by number among those of all blocks, and an external input.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Tap {
    outputs: Vec<usize>,
    external: Option<usize>,
}

/// What [`Interconnection::local`] finds.
#[derive(Debug, Clone)]
pub struct Local {
    /// The form.
    pub value: Complex<f64>,
    /// What each block sees and what weighs there.
    pub members: Vec<Member>,
    /// Gradient by the external inputs.
    pub by_external: Vec<Complex<f64>>,
}

/// One block in a motion.
#[derive(Debug, Clone)]
pub struct Member {
    /// Its inputs u.
    input: Vec<Complex<f64>>,
    /// Its states x.
    state: Vec<Complex<f64>>,
    /// Weight of each output.
    output_weight: Vec<Complex<f64>>,
    /// Weight of the rate of each state.
    state_weight: Vec<Complex<f64>>,
}

impl Member {
    /// `outputᵀ (D u + C x) + weightᵀ (B u + A x)`: what the form has of the block with the matrices of
    /// `block`, linear in them.
    ///
    /// # Panics
    /// If `block` is of another size.
    pub fn part(&self, block: &StateSpace) -> Complex<f64> {
        let outputs = bilinear(&self.output_weight, &block.d, &self.input)
            + bilinear(&self.output_weight, &block.c, &self.state);
        outputs + self.rates(block)
    }

    fn rates(&self, block: &StateSpace) -> Complex<f64> {
        bilinear(&self.state_weight, &block.b, &self.input)
            + bilinear(&self.state_weight, &block.a, &self.state)
    }
}

/// `wᵀ M z`.
fn bilinear(w: &[Complex<f64>], matrix: &DMatrix<f64>, z: &[Complex<f64>]) -> Complex<f64> {
    assert_eq!(matrix.shape(), (w.len(), z.len()), "a block of this size");
    let mut sum = Complex::ZERO;
    for (column, z) in z.iter().enumerate() {
        let rows = w.iter().enumerate();
        sum += rows.map(|(row, w)| w * matrix[(row, column)]).sum::<Complex<f64>>() * z;
    }
    sum
}

/// Blocks whose ports are connected.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Interconnection {
    inputs: Vec<String>,
    outputs: Vec<String>,
    states: Vec<String>,
    /// Per block its states, inputs and outputs among those of all.
    ranges: Vec<[Range<usize>; 3]>,
    /// What each input of the blocks reads.
    reads: Vec<Tap>,
    /// What each output of the whole reads.
    gives: Vec<Tap>,
    /// `block: signal` of each output of the blocks.
    ports: Vec<String>,
}

impl Interconnection {
    /// Connects `blocks` with external `inputs`; `outputs` are the signals that the whole gives.
    ///
    /// # Errors
    /// A block or an output that reads a signal which is neither an output of a block nor external.
    pub fn new(
        blocks: &[Block],
        inputs: Vec<String>,
        outputs: Vec<String>,
    ) -> Result<Self, Unknown> {
        let made: Vec<&String> = blocks.iter().flat_map(|block| &block.outputs).collect();
        let tap = |reader: &str, signal: &String| {
            let outputs: Vec<usize> = (0..made.len()).filter(|&o| made[o] == signal).collect();
            let external = inputs.iter().position(|input| input == signal);
            if outputs.is_empty() && external.is_none() {
                let known = made.iter().copied().chain(&inputs).map(String::as_str);
                return Err(Unknown {
                    reader: reader.into(),
                    signal: signal.clone(),
                    allowed: allowed_instead(signal, known),
                });
            }
            Ok(Tap { outputs, external })
        };
        let mut reads = Vec::new();
        let mut ranges = Vec::new();
        let mut at = [0; 3];
        for block in blocks {
            let counts = [block.states.len(), block.inputs.len(), block.outputs.len()];
            ranges.push(std::array::from_fn(|i| at[i]..at[i] + counts[i]));
            at = std::array::from_fn(|i| at[i] + counts[i]);
            for signal in &block.inputs {
                reads.push(tap(&block.name, signal)?);
            }
        }
        let gives = outputs.iter().map(|s| tap("an output", s)).collect::<Result<_, _>>()?;
        let ports = (blocks.iter())
            .flat_map(|block| block.outputs.iter().map(|s| format!("{}: {s}", block.name)))
            .collect();
        let states = blocks.iter().flat_map(|block| block.states.iter().cloned()).collect();
        Ok(Self { inputs, outputs, states, ranges, reads, gives, ports })
    }

    /// Names of the external inputs.
    pub fn inputs(&self) -> &[String] {
        &self.inputs
    }

    /// Names of the outputs.
    pub fn outputs(&self) -> &[String] {
        &self.outputs
    }

    /// Names of the states, block after block.
    pub fn states(&self) -> &[String] {
        &self.states
    }

    /// The whole, from the numbers of the blocks in their order.
    ///
    /// With u = K y + E w for the inputs of the blocks and w external, the outputs solve
    /// `(1 − D K) y = C x + D E w`. Outputs that depend on no later one are found one after the other;
    /// what remains are loops, solved at once.
    ///
    /// # Errors
    /// [`AlgebraicLoop`] where 1 − D K is singular or badly conditioned in a loop.
    ///
    /// # Panics
    /// If the blocks do not have the sizes of their names.
    pub fn compose(&self, blocks: &[StateSpace]) -> Result<StateSpace, AlgebraicLoop> {
        let (states, externals) = (self.states.len(), self.inputs.len());
        let (through, mut y) = self.direct(blocks);
        self.solve(&through, &mut y)?;

        let mut a = DMatrix::zeros(states, states);
        let mut b = DMatrix::zeros(states, externals);
        for (block, [xs, us, _]) in blocks.iter().zip(&self.ranges) {
            a.view_mut((xs.start, xs.start), (xs.len(), xs.len())).copy_from(&block.a);
            for (input, tap) in self.reads[us.clone()].iter().enumerate() {
                for (state, row) in xs.clone().enumerate() {
                    let gain = block.b[(state, input)];
                    if gain == 0.0 {
                        continue;
                    }
                    if let Some(external) = tap.external {
                        b[(row, external)] += gain;
                    }
                    for &source in &tap.outputs {
                        for column in 0..states {
                            a[(row, column)] += gain * y[(source, column)];
                        }
                        for column in 0..externals {
                            b[(row, column)] += gain * y[(source, states + column)];
                        }
                    }
                }
            }
        }
        let mut c = DMatrix::zeros(self.gives.len(), states);
        let mut d = DMatrix::zeros(self.gives.len(), externals);
        for (row, tap) in self.gives.iter().enumerate() {
            if let Some(external) = tap.external {
                d[(row, external)] += 1.0;
            }
            for &source in &tap.outputs {
                for column in 0..states {
                    c[(row, column)] += y[(source, column)];
                }
                for column in 0..externals {
                    d[(row, column)] += y[(source, states + column)];
                }
            }
        }
        Ok(StateSpace { a, b, c, d })
    }

    /// What each block sees of a motion with given states and external inputs, and what weighs there: for
    /// the form `Σ w_y y + Σ w_x ẋ` of outputs of the whole and rates of states, df is
    /// `outputᵀ (dD u + dC x) + weightᵀ (dB u + dA x)` for a change of a block's matrices.
    ///
    /// # Errors
    /// As [`Interconnection::compose`].
    ///
    /// # Panics
    /// If the blocks or the vectors do not have the sizes of their names.
    pub fn local(
        &self,
        blocks: &[StateSpace],
        [states, external]: [&[Complex<f64>]; 2],
        [output_weights, state_weights]: [&[Complex<f64>]; 2],
    ) -> Result<Local, AlgebraicLoop> {
        let (through, direct) = self.direct(blocks);
        // Real and imaginary part as two columns.
        let known: Vec<Complex<f64>> = states.iter().chain(external).copied().collect();
        let pair = |z: &Complex<f64>, column: usize| if column == 0 { z.re } else { z.im };
        let mut y = direct * DMatrix::from_fn(known.len(), 2, |i, j| pair(&known[i], j));
        self.solve(&through, &mut y)?;
        let output = |source: usize| Complex::new(y[(source, 0)], y[(source, 1)]);
        let input = |tap: &Tap| {
            let outputs = tap.outputs.iter().map(|&source| output(source));
            outputs.sum::<Complex<f64>>() + tap.external.map_or(Complex::ZERO, |e| external[e])
        };
        let inputs: Vec<Complex<f64>> = self.reads.iter().map(input).collect();
        let value: Complex<f64> =
            self.gives.iter().zip(output_weights).map(|(tap, weight)| input(tap) * weight).sum();

        // Backwards: ŷ = Kᵀ (Dᵀ ŷ + Bᵀ w_x) + w_y.
        let mut adjoint = DMatrix::zeros(self.ports.len(), 2);
        let mut by_external = vec![Complex::ZERO; external.len()];
        let mut give = |tap: &Tap, weight: Complex<f64>, to: &mut DMatrix<f64>| {
            for &source in &tap.outputs {
                to[(source, 0)] += weight.re;
                to[(source, 1)] += weight.im;
            }
            if let Some(external) = tap.external {
                by_external[external] += weight;
            }
        };
        for (tap, weight) in self.gives.iter().zip(output_weights) {
            give(tap, *weight, &mut adjoint);
        }
        let through_states = |block: &StateSpace, xs: &Range<usize>, input: usize| {
            let weights = state_weights[xs.clone()].iter().enumerate();
            weights.map(|(state, w)| w * block.b[(state, input)]).sum::<Complex<f64>>()
        };
        for (block, [xs, us, _]) in blocks.iter().zip(&self.ranges) {
            for (input, tap) in self.reads[us.clone()].iter().enumerate() {
                give(tap, through_states(block, xs, input), &mut adjoint);
            }
        }
        self.solve(&through.transpose(), &mut adjoint)?;
        let weight = |port: usize| Complex::new(adjoint[(port, 0)], adjoint[(port, 1)]);
        let mut rates = Complex::ZERO;
        let mut members = Vec::new();
        for (block, [xs, us, ys]) in blocks.iter().zip(&self.ranges) {
            let member = Member {
                input: inputs[us.clone()].to_vec(),
                state: states[xs.clone()].to_vec(),
                output_weight: ys.clone().map(weight).collect(),
                state_weight: state_weights[xs.clone()].to_vec(),
            };
            rates += member.rates(block);
            // The share of external inputs that goes straight through a block.
            for (input, tap) in self.reads[us.clone()].iter().enumerate() {
                if let Some(external) = tap.external {
                    let outputs = member.output_weight.iter().enumerate();
                    by_external[external] +=
                        outputs.map(|(o, w)| w * block.d[(o, input)]).sum::<Complex<f64>>();
                }
            }
            members.push(member);
        }
        Ok(Local { value: value + rates, members, by_external })
    }

    /// Output ports of `blocks` that depend on themselves without a state between, as `block: signal`.
    ///
    /// # Panics
    /// If the blocks do not have the sizes of their names.
    pub fn find_loop(&self, blocks: &[StateSpace]) -> Option<Vec<String>> {
        let (through, _) = self.direct(blocks);
        let mut open: Vec<usize> = (0..self.ports.len()).collect();
        loop {
            let waits = |row: &usize| open.iter().any(|&o| through[(*row, o)] != 0.0);
            let left: Vec<usize> = open.iter().copied().filter(waits).collect();
            if left.len() == open.len() {
                break;
            }
            open = left;
        }
        let core = core(&through, open);
        (!core.is_empty()).then(|| core.iter().map(|&port| self.ports[port].clone()).collect())
    }

    /// D K between the outputs of the blocks, and `[C, D E]` for states and external inputs.
    fn direct(&self, blocks: &[StateSpace]) -> (DMatrix<f64>, DMatrix<f64>) {
        assert_eq!(blocks.len(), self.ranges.len(), "a system for each block");
        let states = self.states.len();
        let mut y = DMatrix::zeros(self.ports.len(), states + self.inputs.len());
        let mut through = DMatrix::zeros(self.ports.len(), self.ports.len());
        for (block, [xs, us, ys]) in blocks.iter().zip(&self.ranges) {
            let sizes = [xs.len(), us.len(), ys.len()];
            assert_eq!([block.order(), block.inputs(), block.outputs()], sizes);
            y.view_mut((ys.start, xs.start), (ys.len(), xs.len())).copy_from(&block.c);
            for (input, tap) in self.reads[us.clone()].iter().enumerate() {
                for (output, row) in ys.clone().enumerate() {
                    let gain = block.d[(output, input)];
                    if gain == 0.0 {
                        continue;
                    }
                    if let Some(external) = tap.external {
                        y[(row, states + external)] += gain;
                    }
                    for &source in &tap.outputs {
                        through[(row, source)] += gain;
                    }
                }
            }
        }
        (through, y)
    }

    /// Solves `(1 − through) y = y` in place.
    fn solve(&self, through: &DMatrix<f64>, y: &mut DMatrix<f64>) -> Result<(), AlgebraicLoop> {
        let mut open: Vec<usize> = (0..through.nrows()).collect();
        while !open.is_empty() {
            let needs = |row: usize, of: &[usize]| of.iter().any(|&o| through[(row, o)] != 0.0);
            let ready: Vec<usize> =
                open.iter().copied().filter(|&row| !needs(row, &open)).collect();
            let next = if ready.is_empty() {
                let core = core(through, open.clone());
                self.solve_loop(through, &core, y)?;
                core
            } else {
                ready
            };
            open.retain(|row| !next.contains(row));
            // What waits for the outputs found gets their share.
            for &row in &open {
                for &source in &next {
                    let gain = through[(row, source)];
                    if gain != 0.0 {
                        for column in 0..y.ncols() {
                            y[(row, column)] += gain * y[(source, column)];
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn solve_loop(
        &self,
        through: &DMatrix<f64>,
        members: &[usize],
        y: &mut DMatrix<f64>,
    ) -> Result<(), AlgebraicLoop> {
        let n = members.len();
        let refuse = |condition: f64| AlgebraicLoop {
            ports: members.iter().map(|&port| self.ports[port].clone()).collect(),
            condition,
        };
        let mut gains = DMatrix::from_fn(n, n, |i, j| through[(members[i], members[j])]);
        if !gains.iter().all(|x| x.is_finite()) {
            return Err(refuse(f64::NAN));
        }
        // Units of the signals must not count: balance first.
        let by = nalgebra::linalg::balancing::balance_parlett_reinsch(&mut gains);
        let matrix = DMatrix::identity(n, n) - gains;
        let norm = |m: &DMatrix<f64>| -> f64 {
            m.column_iter().map(|column| column.lp_norm(1)).fold(0.0, f64::max)
        };
        let Some(inverse) = matrix.clone().try_inverse() else {
            return Err(refuse(f64::INFINITY));
        };
        let condition = norm(&matrix) * norm(&inverse);
        if !(condition <= LARGEST_CONDITION) {
            return Err(refuse(condition));
        }
        let right = DMatrix::from_fn(n, y.ncols(), |i, j| y[(members[i], j)] / by[i]);
        let solved = inverse * right;
        for (i, &member) in members.iter().enumerate() {
            for column in 0..y.ncols() {
                y[(member, column)] = solved[(i, column)] * by[i];
            }
        }
        Ok(())
    }
}

/// Of outputs that all wait for another one of them, those in the loops and between.
fn core(through: &DMatrix<f64>, mut waiting: Vec<usize>) -> Vec<usize> {
    loop {
        let feeds = |o: &usize| waiting.iter().any(|&row| through[(row, *o)] != 0.0);
        let kept: Vec<usize> = waiting.iter().copied().filter(feeds).collect();
        if kept.len() == waiting.len() {
            return kept;
        }
        waiting = kept;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Complex, dmatrix};

    fn names(list: &[&str]) -> Vec<String> {
        list.iter().map(|s| (*s).to_owned()).collect()
    }

    fn block(name: &str, inputs: &[&str], outputs: &[&str], states: usize) -> Block {
        let states = (0..states).map(|i| format!("{name}.{i}")).collect();
        Block { name: name.into(), inputs: names(inputs), outputs: names(outputs), states }
    }

    fn gain(value: f64) -> StateSpace {
        StateSpace::gain(dmatrix![value])
    }

    /// `k/(s + p) + d`.
    fn lag(k: f64, p: f64, d: f64) -> StateSpace {
        StateSpace { a: dmatrix![-p], b: dmatrix![1.0], c: dmatrix![k], d: dmatrix![d] }
    }

    #[test]
    fn inputs_read_the_sum_of_all_outputs_of_their_name_and_of_the_external_one() {
        let blocks = [
            block("one", &["a"], &["sum"], 0),
            block("two", &["b"], &["sum"], 0),
            block("three", &["sum"], &["out"], 0),
        ];
        let whole =
            Interconnection::new(&blocks, names(&["a", "b", "sum"]), names(&["out", "sum"]))
                .unwrap();
        let system = whole.compose(&[gain(2.0), gain(3.0), gain(10.0)]).unwrap();
        assert_eq!(system.d, dmatrix![20.0, 30.0, 10.0; 2.0, 3.0, 1.0]);
    }

    #[test]
    fn a_feedback_loop_is_the_closed_form() {
        let blocks = [
            block("plant", &["u"], &["y"], 1),
            block("control", &["y"], &["back"], 1),
            block("sign", &["back"], &["u"], 0),
        ];
        let whole = Interconnection::new(&blocks, names(&["u"]), names(&["y"])).unwrap();
        let (plant, control) = (lag(4.0, 2.0, 0.3), lag(5.0, 7.0, 0.6));
        let system = whole.compose(&[plant.clone(), control.clone(), gain(-1.0)]).unwrap();
        for omega in [0.0, 1.0, 9.0] {
            let s = Complex::new(0.1, omega);
            let (p, f) = (plant.response(s).unwrap()[(0, 0)], control.response(s).unwrap()[(0, 0)]);
            let expected = p / (p * f + 1.0);
            assert!((system.response(s).unwrap()[(0, 0)] - expected).norm() < 1e-14);
        }
    }

    #[test]
    fn an_algebraic_loop_without_a_solution_names_its_ports_whatever_their_units() {
        let blocks = [
            block("before", &["w"], &["in"], 0),
            block("strong", &["in"], &["force"], 0),
            block("weak", &["force"], &["in"], 0),
            block("after", &["force"], &["out"], 0),
        ];
        let whole = Interconnection::new(&blocks, names(&["w"]), names(&["out"])).unwrap();
        let with = |strong, weak| whole.compose(&[gain(1.0), gain(strong), gain(weak), gain(2.0)]);
        let refused = with(4e7, 2.5e-8).unwrap_err();
        assert_eq!(refused.ports, ["strong: force", "weak: in"]);
        assert!(with(4e7, 2.5e-8 * (1.0 + 1e-9)).is_err());
        assert!(with(f64::NAN, 1.0).is_err());
        // A loop gain of one half doubles.
        assert!((with(4e7, 1.25e-8).unwrap().d[(0, 0)] / 1.6e8 - 1.0).abs() < 1e-14);
    }

    #[test]
    fn large_gains_without_a_loop_are_no_loop() {
        let blocks = [block("a", &["w"], &["x"], 0), block("b", &["x"], &["y"], 0)];
        let whole = Interconnection::new(&blocks, names(&["w"]), names(&["y"])).unwrap();
        assert_eq!(whole.compose(&[gain(1e9), gain(1e9)]).unwrap().d, dmatrix![1e18]);
    }

    #[test]
    fn a_signal_that_nothing_makes_is_named_with_its_neighbour() {
        let blocks = [block("a", &["gyro.fwd.rol"], &["x"], 0)];
        let error = Interconnection::new(&blocks, names(&["gyro.fwd.roll"]), names(&["x"]));
        let error = error.unwrap_err();
        assert_eq!((error.reader.as_str(), error.signal.as_str()), ("a", "gyro.fwd.rol"));
        assert!(error.allowed.contains("did you mean `gyro.fwd.roll`"), "{error}");
    }
}
