/* A planar two-link chain as an engine for `twolink conform`, in C: closed forms, one JSON line each.
 *
 *     cc -O2 -o engine engine.c -lm
 *     twolink conform 'cmd: ./engine'
 *
 * Replace `answer` by calls of your engine. Joint angles: t1 from x, t2 from link 1; y points down. */
#define _GNU_SOURCE
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static double m[2], L[2], c[4], I[2], g[1], damping[2], friction[2], armature[2];

/* Read all numbers of the value of a key, however they are nested; return how many there are. */
static int numbers(const char *line, const char *key, double *out, int most) {
    char quoted[64];
    snprintf(quoted, sizeof quoted, "\"%s\":", key);
    const char *at = strstr(line, quoted);
    if (!at) return 0;
    at += strlen(quoted);
    int depth = 0, count = 0;
    do {
        while (*at == ' ') at++;
        if (*at == '[') { depth++; at++; }
        else if (*at == ']') { depth--; at++; }
        else if (*at == ',') at++;
        else {
            char *end;
            double value = strtod(at, &end);
            if (end == at || count == most) break;
            out[count++] = value;
            at = end;
        }
    } while (depth > 0 && *at);
    return count;
}

/* Read the string of a key. */
static void word(const char *line, const char *key, char *out, size_t size) {
    char quoted[64];
    snprintf(quoted, sizeof quoted, "\"%s\": \"", key);
    const char *at = strstr(line, quoted);
    size_t length = at ? strcspn(at += strlen(quoted), "\"") : 0;
    if (length >= size) length = size - 1;
    memcpy(out, at ? at : "", length);
    out[length] = 0;
}

static void model(const char *line) {
    numbers(line, "mass", m, 2), numbers(line, "length", L, 2), numbers(line, "centre", c, 4);
    numbers(line, "inertia", I, 2), numbers(line, "gravity", g, 1);
    numbers(line, "damping", damping, 2), numbers(line, "friction", friction, 2);
    numbers(line, "armature", armature, 2);
    if (m[0] > 0 && m[1] > 0)
        printf("{\"ok\": true, \"understood\": {\"mass\": [%.17g, %.17g]}}\n", m[0], m[1]);
    else
        printf("{\"refused\": \"masses must be positive\"}\n");
}

/* Write the value of a quantity in a state to out; return the numbers in a row, or -1. */
static int answer(const char *quantity, const double *t, const double *w, const double *a,
                  const double *tau, double *out) {
    double c1 = cos(t[0]), s1 = sin(t[0]), c2 = cos(t[1]), s2 = sin(t[1]);
    double c12 = cos(t[0] + t[1]), s12 = sin(t[0] + t[1]);
    double X = L[0] * (c[2] * c2 - c[3] * s2), h = m[1] * L[0] * (c[2] * s2 + c[3] * c2);
    double M22 = I[1] + m[1] * (c[2] * c[2] + c[3] * c[3]), M12 = M22 + m[1] * X;
    double M11 = I[0] + m[0] * (c[0] * c[0] + c[1] * c[1]) + m[1] * L[0] * L[0] + 2 * m[1] * X + M22;
    double C[2] = {-h * (2 * w[0] * w[1] + w[1] * w[1]), h * w[0] * w[0]};
    double G2 = -g[0] * m[1] * (c[2] * c12 - c[3] * s12);
    double G1 = -g[0] * (m[0] * (c[0] * c1 - c[1] * s1) + m[1] * L[0] * c1) + G2;
    double x1 = -L[0] * s1 - L[1] * s12, x2 = -L[1] * s12, y1 = L[0] * c1 + L[1] * c12, y2 = L[1] * c12;
    double R[2];
    M11 += armature[0], M22 += armature[1];
    for (int k = 0; k < 2; k++)
        R[k] = C[k] + (k ? G2 : G1) + damping[k] * w[k] + friction[k] * ((w[k] > 0) - (w[k] < 0));
#define IS(name) (!strcmp(quantity, name))
#define TWO(x, y) return out[0] = (x), out[1] = (y), 2
    if (IS("mass_matrix")) return out[0] = M11, out[1] = out[2] = M12, out[3] = M22, 4;
    if (IS("velocity_terms")) TWO(C[0], C[1]);
    if (IS("gravity_terms")) TWO(G1, G2);
    if (IS("inverse_dynamics")) TWO(M11 * a[0] + M12 * a[1] + R[0], M12 * a[0] + M22 * a[1] + R[1]);
    if (IS("forward_dynamics")) {
        double r1 = tau[0] - R[0], r2 = tau[1] - R[1], det = M11 * M22 - M12 * M12;
        TWO((M22 * r1 - M12 * r2) / det, (M11 * r2 - M12 * r1) / det);
    }
    if (IS("kinetic_energy"))
        return out[0] = M11 * w[0] * w[0] / 2 + M12 * w[0] * w[1] + M22 * w[1] * w[1] / 2, 1;
    if (IS("potential_energy"))
        return out[0] = -g[0] * (m[0] * (c[0] * s1 + c[1] * c1)
                                 + m[1] * (L[0] * s1 + c[2] * s12 + c[3] * c12)), 1;
    if (IS("position")) TWO(L[0] * c1 + L[1] * c12, L[0] * s1 + L[1] * s12);
    if (IS("velocity")) TWO(x1 * w[0] + x2 * w[1], y1 * w[0] + y2 * w[1]);
    if (IS("acceleration")) {
        double v1 = w[0] * w[0], v2 = (w[0] + w[1]) * (w[0] + w[1]);
        TWO(x1 * a[0] + x2 * a[1] - L[0] * c1 * v1 - L[1] * c12 * v2,
            y1 * a[0] + y2 * a[1] - L[0] * s1 * v1 - L[1] * s12 * v2);
    }
    if (IS("jacobian")) return out[0] = x1, out[1] = x2, out[2] = y1, out[3] = y2, 4;
    return -1;
}

static void ask(const char *line) {
    enum { MOST = 200000 };
    static double t[MOST], w[MOST], a[MOST], tau[MOST];
    double seq = 0, out[4];
    char quantity[64];
    numbers(line, "seq", &seq, 1);
    word(line, "quantity", quantity, sizeof quantity);
    int states = numbers(line, "angles", t, MOST) / 2;
    numbers(line, "speeds", w, MOST), numbers(line, "accelerations", a, MOST);
    numbers(line, "torques", tau, MOST);
    if (answer(quantity, t, w, a, tau, out) < 0) {
        printf("{\"seq\": %.0f, \"skipped\": true, \"message\": \"not implemented\"}\n", seq);
        return;
    }
    printf("{\"seq\": %.0f, \"values\": [", seq);
    for (int k = 0; k < 2 * states; k += 2) {
        int count = answer(quantity, t + k, w + k, a + k, tau + k, out);
        const char *form = count == 1 ? "%s%.17g" : count == 2 ? "%s[%.17g, %.17g]"
                                      : "%s[[%.17g, %.17g], [%.17g, %.17g]]";
        printf(form, k ? ", " : "", out[0], out[1], out[2], out[3]);
    }
    printf("]}\n");
}

int main(void) {
    char *line = NULL, cmd[16];
    size_t size = 0;
    while (getline(&line, &size, stdin) > 0) {
        word(line, "cmd", cmd, sizeof cmd);
        if (!strcmp(cmd, "start")) puts(
            "{\"version\": 1, \"engine\": {\"name\": \"closed form in C\", \"version\": \"1\","
            " \"language\": \"c\", \"reads\": [\"parameters\"], \"answers\": [\"mass_matrix\","
            " \"velocity_terms\", \"gravity_terms\", \"inverse_dynamics\", \"forward_dynamics\","
            " \"kinetic_energy\", \"potential_energy\", \"position\", \"velocity\", \"acceleration\","
            " \"jacobian\"], \"effects\": [\"joint_damping\", \"joint_friction\", \"armature\"]}}");
        else if (!strcmp(cmd, "model")) model(line);
        else if (!strcmp(cmd, "ask")) ask(line);
        else if (!strcmp(cmd, "stop")) break;
        fflush(stdout);
    }
    free(line);
    return 0;
}
