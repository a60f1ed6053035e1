# The poles of a run of tvse in Julia: flat columns only.
#
#   tvse run runs/notebook.toml
#   julia -e 'using Pkg; Pkg.add(["Parquet2", "DataFrames"])'
#   julia notebooks/poles.jl

using DataFrames, Parquet2, Statistics

tables = joinpath("runs", "notebook", "tables")
modes = DataFrame(Parquet2.Dataset(joinpath(tables, "modes.parquet")))
cases = DataFrame(Parquet2.Dataset(joinpath(tables, "cases.parquet")))

# Share of unstable cases by variant and flight time.
dispersed = subset(modes, :population => ByRow(==("dispersed")), :status => ByRow(==("ok")))
least = combine(groupby(dispersed, [:case, :variant, :flight_time_s]), :damping_ratio => minimum => :damping_ratio)
share = combine(groupby(least, [:variant, :flight_time_s]), :damping_ratio => (x -> 100 * mean(x .< 0)) => :unstable_percent)
println(sort(share, [:variant, :flight_time_s]))

# What jet damping adds on the same draws.
drawn = subset(cases, :population => ByRow(==("dispersed")))
gain = drawn.damping_ratio_min_jet_damping_tvse .- drawn.damping_ratio_min_no_jet_damping_tvse
println("jet damping adds ", round(100 * mean(gain), digits = 3), " % of damping on average")
