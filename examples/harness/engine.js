// A planar two-link chain as an engine for `twolink conform`, in JavaScript: closed forms.
//
//     twolink conform 'cmd: node engine.js'
//
// Replace the entries of `quantities` by calls of your engine.
// Joint angles: t1 from x, t2 from link 1; y points down.
"use strict";

let chain;

function terms({ t, w }) {
  const { mass: m, length: L, centre, inertia: I, gravity: g } = chain;
  const { damping, friction, armature } = chain;
  const [[a1, b1], [a2, b2]] = centre;
  const [c1, s1] = [Math.cos(t[0]), Math.sin(t[0])];
  const [c2, s2] = [Math.cos(t[1]), Math.sin(t[1])];
  const [c12, s12] = [Math.cos(t[0] + t[1]), Math.sin(t[0] + t[1])];
  const X = L[0] * (a2 * c2 - b2 * s2);
  const h = m[1] * L[0] * (a2 * s2 + b2 * c2);
  const about2 = I[1] + m[1] * (a2 * a2 + b2 * b2);
  const about1 = I[0] + m[0] * (a1 * a1 + b1 * b1) + m[1] * L[0] * L[0];
  const M12 = about2 + m[1] * X;
  const M = [
    [about1 + 2 * m[1] * X + about2 + armature[0], M12],
    [M12, about2 + armature[1]],
  ];
  const C = [-h * (2 * w[0] + w[1]) * w[1], h * w[0] * w[0]];
  const G2 = -g * m[1] * (a2 * c12 - b2 * s12);
  const G = [-g * (m[0] * (a1 * c1 - b1 * s1) + m[1] * L[0] * c1) + G2, G2];
  const rest = [0, 1].map((k) => C[k] + G[k] + damping[k] * w[k] + friction[k] * Math.sign(w[k]));
  const V =
    -g * (m[0] * (a1 * s1 + b1 * c1) + m[1] * (L[0] * s1 + a2 * s12 + b2 * c12));
  const J = [
    [-L[0] * s1 - L[1] * s12, -L[1] * s12],
    [L[0] * c1 + L[1] * c12, L[1] * c12],
  ];
  const [v1, v2] = [L[0] * w[0] ** 2, L[1] * (w[0] + w[1]) ** 2];
  const bias = [-c1 * v1 - c12 * v2, -s1 * v1 - s12 * v2];
  return { M, C, G, rest, V, J, bias, D: [J[1][0], -J[0][0]] };
}

const times = (A, x) => A.map(([p, q]) => p * x[0] + q * x[1]);
const plus = (x, y) => [x[0] + y[0], x[1] + y[1]];

function solved([[M11, M12], [, M22]], [r1, r2]) {
  const det = M11 * M22 - M12 * M12;
  return [(M22 * r1 - M12 * r2) / det, (M11 * r2 - M12 * r1) / det];
}

const quantities = {
  mass_matrix: ({ M }) => M,
  velocity_terms: ({ C }) => C,
  gravity_terms: ({ G }) => G,
  inverse_dynamics: ({ M, rest }, { a }) => plus(times(M, a), rest),
  forward_dynamics: ({ M, rest }, { tau }) => solved(M, [tau[0] - rest[0], tau[1] - rest[1]]),
  kinetic_energy: ({ M }, { w }) => {
    const p = times(M, w);
    return (p[0] * w[0] + p[1] * w[1]) / 2;
  },
  potential_energy: ({ V }) => V,
  position: ({ D }) => D,
  velocity: ({ J }, { w }) => times(J, w),
  acceleration: ({ J, bias }, { a }) => plus(times(J, a), bias),
  jacobian: ({ J }) => J,
};

const answers = {
  start: () => ({
    version: 1,
    engine: {
      name: "closed form in JavaScript",
      version: "1",
      language: "javascript",
      reads: ["parameters"],
      answers: Object.keys(quantities),
      effects: ["joint_damping", "joint_friction", "armature"],
    },
  }),
  model: ({ parameters }) => {
    if (!parameters.mass.every((mass) => mass > 0)) return { refused: "masses must be positive" };
    chain = parameters;
    return { ok: true, understood: { mass: chain.mass, inertia: chain.inertia } };
  },
  ask: ({ seq, quantity, states }) => {
    if (!(quantity in quantities)) return { seq, skipped: true, message: "not implemented" };
    const zero = [0, 0];
    const values = states.angles.map((t, k) => {
      const w = states.speeds ? states.speeds[k] : zero;
      const a = states.accelerations ? states.accelerations[k] : zero;
      const tau = states.torques ? states.torques[k] : zero;
      return quantities[quantity](terms({ t, w }), { w, a, tau });
    });
    return { seq, values };
  },
};

// JSON has no NaN and no infinities: the protocol has words for them.
const word = (_, x) =>
  typeof x === "number" && !Number.isFinite(x)
    ? { NaN: "nan", Infinity: "inf", "-Infinity": "-inf" }[String(x)]
    : x;

require("readline")
  .createInterface({ input: process.stdin })
  .on("line", (line) => {
    const request = JSON.parse(line);
    if (request.cmd === "stop") process.exit(0);
    process.stdout.write(JSON.stringify(answers[request.cmd](request), word) + "\n");
  });
