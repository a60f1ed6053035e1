% The poles of a run of tvse in MATLAB (R2019a or newer): flat columns only, no toolbox.
%
%   tvse run runs/notebook.toml          (in a shell, once)
%   run notebooks/poles.m                (in MATLAB, in the folder of the repository)

tables = fullfile("runs", "notebook", "tables");
modes = parquetread(fullfile(tables, "modes.parquet"), SelectedVariableNames = ...
    ["population", "variant", "flight_time_s", "branch", "pole_re_rad_s", "pole_im_rad_s", "damping_ratio", "case"]);
cases = parquetread(fullfile(tables, "cases.parquet"), SelectedVariableNames = ...
    ["population", "case", "damping_ratio_min_no_jet_damping_tvse", "damping_ratio_min_jet_damping_tvse"]);

% Figure 6 of the paper: nominal and dispersed poles without and with jet damping at 110 s.
figure; hold on; grid on
variants = ["no_jet_damping", "jet_damping"];
marks = ["o", "s"];
colours = [0.835 0.369 0; 0 0.447 0.698];
at = modes.flight_time_s == 110 & string(modes.branch) == "primary";
for k = 1:2
    chosen = at & string(modes.variant) == variants(k);
    dispersed = chosen & string(modes.population) == "dispersed";
    nominal = chosen & string(modes.population) == "nominal";
    plot(modes.pole_re_rad_s(dispersed), modes.pole_im_rad_s(dispersed), marks(k), ...
        Color = colours(k, :), MarkerSize = 3, DisplayName = strrep(variants(k), "_", " "));
    plot(modes.pole_re_rad_s(nominal), modes.pole_im_rad_s(nominal), marks(k), ...
        MarkerFaceColor = colours(k, :), MarkerEdgeColor = "k", MarkerSize = 10, HandleVisibility = "off");
end
xline(0, HandleVisibility = "off");
xlabel("real part, rad/s"); ylabel("imaginary part, rad/s"); legend

% The smallest damping ratio over the flight times, without and with jet damping on the same draws.
drawn = cases(string(cases.population) == "dispersed", :);
gain = drawn.damping_ratio_min_jet_damping_tvse - drawn.damping_ratio_min_no_jet_damping_tvse;
fprintf("jet damping adds %.3f %% of damping on average, %.3f %% at least, in %d cases\n", ...
    100 * mean(gain), 100 * min(gain), height(drawn));
