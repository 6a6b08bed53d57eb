% The peer's side of readers.py, run by Octave or MATLAB: NLvib's own residual for a .mat of patchfem export at its Omega.
% arguments: folder SRC of NLvib, file, harmonics, samples; prints half the peak-to-peak of the output [m].
args = argv();
addpath(args{1}); addpath(fullfile(args{1}, 'MechanicalSystems'));
load(args{2});
H = str2double(args{3}); N = str2double(args{4}); n = size(M, 1);
held = K + 1i*Omega*D - Omega^2*M;
for k = 1:numel(nonlinear_elements)
    one = nonlinear_elements{k};
    nonlinear_elements{k}.islocal = true;
    nonlinear_elements{k}.ishysteretic = logical(one.ishysteretic);
    w = one.force_direction;
    if isfield(one, 'stiffness')
        held = held + one.stiffness * (w * w');
    else
        held = held + 1i*Omega*one.friction_limit_force/one.eps * (w * w');
    end
end
rig = MechanicalSystem(M, D, K, nonlinear_elements, Fex1);
first = held \ Fex1;
x0 = zeros((2*H+1)*n, 1); x0(n+(1:2*n)) = [real(first); -imag(first)];
scale = max(abs(x0)); size0 = norm(Fex1);
function [R, J] = part(y, rig, Omega, H, N, scale, size0)
    [R, J] = HB_residual([y*scale; Omega], rig, H, N, 'FRF');
    R = R/size0; J = J(:, 1:end-1)*scale/size0;
end
x = x0/scale;
for k = 1:100
    [R, J] = part(x, rig, Omega, H, N, scale, size0);
    step = -J\R; share = 1;
    while norm(part(x + share*step, rig, Omega, H, N, scale, size0)) > norm(R) && share > 1e-3
        share = share/2;
    end
    x = x + share*step;
    if norm(share*step) < 1e-10, break; end
end
q = reshape(x*scale, n, 2*H+1); moved = T_out*q;
t = linspace(0, 2*pi, 20001)';
y = moved(1) + cos(t*(1:H))*moved(2:2:end)' + sin(t*(1:H))*moved(3:2:end)';
printf('{"amplitude": %.15g, "rest": %.3g}\n', (max(y)-min(y))/2, norm(R));
