% A planar two-link chain as an engine for `twolink conform`, in Octave 7 or later: closed forms.
%
%     twolink conform 'cmd: octave-cli --no-init-file --quiet --no-line-editing engine.m'
%
% Replace `value` by calls of your engine. Joint angles: t1 from x, t2 from link 1; y points down.
1;

function x = two(state, name)
  % A field of a state, or zero where it is not needed.
  x = [0; 0];
  if isfield(state, name)
    x = state.(name);
  end
end

function found = value(quantity, p, state)
  t = two(state, "angles"); w = two(state, "speeds");
  a = two(state, "accelerations"); tau = two(state, "torques");
  m = p.mass; L = p.length; c = p.centre; I = p.inertia; g = p.gravity;
  c1 = cos(t(1)); s1 = sin(t(1)); c2 = cos(t(2)); s2 = sin(t(2));
  c12 = cos(t(1) + t(2)); s12 = sin(t(1) + t(2));
  X = L(1) * (c(2,1) * c2 - c(2,2) * s2);
  h = m(2) * L(1) * (c(2,1) * s2 + c(2,2) * c2);
  about2 = I(2) + m(2) * (c(2,1)^2 + c(2,2)^2);
  about1 = I(1) + m(1) * (c(1,1)^2 + c(1,2)^2) + m(2) * L(1)^2;
  M12 = about2 + m(2) * X;
  M = [about1 + 2 * m(2) * X + about2, M12; M12, about2] + diag(p.armature);
  C = [-h * (2 * w(1) + w(2)) * w(2); h * w(1)^2];
  G2 = -g * m(2) * (c(2,1) * c12 - c(2,2) * s12);
  G = [-g * (m(1) * (c(1,1) * c1 - c(1,2) * s1) + m(2) * L(1) * c1) + G2; G2];
  rest = C + G + p.damping(:) .* w + p.friction(:) .* sign(w);
  J = [-L(1) * s1 - L(2) * s12, -L(2) * s12; L(1) * c1 + L(2) * c12, L(2) * c12];
  v1 = L(1) * w(1)^2; v2 = L(2) * (w(1) + w(2))^2;
  switch quantity
    case "mass_matrix", found = M;
    case "velocity_terms", found = C;
    case "gravity_terms", found = G;
    case "inverse_dynamics", found = M * a + rest;
    case "forward_dynamics", found = M \ (tau - rest);
    case "kinetic_energy", found = w' * M * w / 2;
    case "potential_energy"
      found = -g * (m(1) * (c(1,1) * s1 + c(1,2) * c1) ...
                    + m(2) * (L(1) * s1 + c(2,1) * s12 + c(2,2) * c12));
    case "position", found = [J(2,1); -J(1,1)];
    case "velocity", found = J * w;
    case "acceleration", found = J * a - [c1 * v1 + c12 * v2; s1 * v1 + s12 * v2];
    case "jacobian", found = J;
    otherwise, found = [];
  end
end

function text = number(x)
  % JSON has no NaN and no infinities: the protocol has words for them.
  if isfinite(x)
    text = sprintf("%.17g", x);
  elseif isnan(x)
    text = '"nan"';
  elseif x > 0
    text = '"inf"';
  else
    text = '"-inf"';
  end
end

function text = listed(x)
  % A number, a row for a column, or rows for a matrix.
  if isscalar(x)
    text = number(x);
  elseif iscolumn(x)
    text = ["[", strjoin(arrayfun(@number, x', "UniformOutput", false), ", "), "]"];
  else
    rows = arrayfun(@(k) listed(x(k,:)'), 1:rows(x), "UniformOutput", false);
    text = ["[", strjoin(rows, ", "), "]"];
  end
end

function reply = answer(request, p)
  names = fieldnames(request.states);
  values = {};
  for k = 1:rows(request.states.angles)
    state = struct();
    for n = 1:numel(names)
      state.(names{n}) = request.states.(names{n})(k,:)';
    end
    found = value(request.quantity, p, state);
    if isempty(found)
      reply = sprintf('{"seq": %d, "skipped": true, "message": "not implemented"}', request.seq);
      return
    end
    values{k} = listed(found);
  end
  reply = sprintf('{"seq": %d, "values": [%s]}', request.seq, strjoin(values, ", "));
end

about = ['{"version": 1, "engine": {"name": "closed form in Octave", "version": "1", ' ...
         '"language": "octave", "reads": ["parameters"], "answers": ["mass_matrix", ' ...
         '"velocity_terms", "gravity_terms", "inverse_dynamics", "forward_dynamics", ' ...
         '"kinetic_energy", "potential_energy", "position", "velocity", "acceleration", ' ...
         '"jacobian"], "effects": ["joint_damping", "joint_friction", "armature"]}}'];
chain = [];
while true
  % fgetl would wait for the beginning of the next line.
  request = jsondecode(input("", "s"));
  switch request.cmd
    case "start"
      puts([about, "\n"]);
    case "model"
      if all(request.parameters.mass > 0)
        chain = request.parameters;
        puts("{\"ok\": true}\n");
      else
        puts("{\"refused\": \"masses must be positive\"}\n");
      end
    case "ask"
      puts([answer(request, chain), "\n"]);
    case "stop"
      break
  end
  fflush(stdout);
end
