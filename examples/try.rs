use tvse::structure::*;
fn main() {
    let text = std::fs::read_to_string("vehicles/sls-like/stick.toml").unwrap();
    let stick = Stick::parse(&text, "stick.toml").unwrap_or_else(|e| panic!("{e}"));
    let t0 = std::time::Instant::now();
    let (modal, rigid) = solve(&stick, &stick.flight_times_s.clone(), Selection::UpTo(20.0), &Default::default()).unwrap();
    println!("{:?} nodes {} grids {}", t0.elapsed(), stick.nodes.len(), modal.sets[0].grids.len());
    for (s, r) in modal.sets.iter().zip(&rigid) {
        println!("t {} {:?} modes {} mass {} cg {:?}", s.flight_time_s, r, s.modes.len(), s.body.mass_kg, s.body.cg_m);
        let l = s.grid("booster.left.gimbal").unwrap();
        let g = s.grid("booster.right.gimbal").unwrap();
        for m in &s.modes {
            if m.frequency_hz > 8.0 { continue; }
            let c = Character::of(m, &s.grids).unwrap();
            println!("  {} {:7.4} {:10} {:3.0}%  L {:9.2e} {:9.2e} {:9.2e} | {:9.2e} {:9.2e} {:9.2e}  R {:9.2e} {:9.2e} {:9.2e} | {:9.2e} {:9.2e} {:9.2e}", m.label, m.frequency_hz, c.direction.to_string(), 100.0*c.share, m.shape[l].x, m.shape[l].y, m.shape[l].z, m.slope[l].x, m.slope[l].y, m.slope[l].z,
              m.shape[g].x, m.shape[g].y, m.shape[g].z, m.slope[g].x, m.slope[g].y, m.slope[g].z);
        }
    }
    for p in &modal.parents { println!("{p:?}"); }
}
