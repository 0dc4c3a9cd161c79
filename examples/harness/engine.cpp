// A planar two-link chain as an engine for `twolink conform`, in C++17: closed forms, JSON lines.
//
//     c++ -std=c++17 -O2 -o engine engine.cpp
//     twolink conform 'cmd: ./engine'
//
// Replace `quantities` by calls of your engine. Angles: t1 from x, t2 from link 1; y points down.
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <iostream>
#include <map>
#include <string>
#include <vector>

using Numbers = std::vector<double>;
using Pair = std::array<double, 2>;

// Return all numbers of the value of a key, however they are nested.
static Numbers numbers(const std::string& line, const std::string& key) {
    Numbers found;
    auto start = line.find("\"" + key + "\":");
    if (start == std::string::npos) return found;
    const char* at = line.c_str() + start + key.size() + 3;
    int depth = 0;
    do {
        if (*at == '[') ++depth, ++at;
        else if (*at == ']') --depth, ++at;
        else if (*at == ' ' || *at == ',') ++at;
        else {
            char* end;
            found.push_back(std::strtod(at, &end));
            if (end == at) return {};
            at = end;
        }
    } while ((depth > 0 || found.empty()) && *at);
    return found;
}

// Return the string of a key.
static std::string word(const std::string& line, const std::string& key) {
    const std::string quoted = "\"" + key + "\": \"";
    auto start = line.find(quoted);
    if (start == std::string::npos) return "";
    start += quoted.size();
    return line.substr(start, line.find('"', start) - start);
}

static struct Chain {
    Numbers m, L, c, I, g, damping, friction, armature;
} chain;

struct State {
    Pair t, w, a, tau;
    double c1, s1, c12, s12, x1, x2, y1, y2, M11, M12, M22;
    Pair C, G, R;

    State(Pair t, Pair w, Pair a, Pair tau) : t(t), w(w), a(a), tau(tau) {
        const auto& [m, L, c, I, g, damping, friction, armature] = chain;
        double c2 = std::cos(t[1]), s2 = std::sin(t[1]);
        c1 = std::cos(t[0]), s1 = std::sin(t[0]);
        c12 = std::cos(t[0] + t[1]), s12 = std::sin(t[0] + t[1]);
        x2 = -L[1] * s12, y2 = L[1] * c12, x1 = x2 - L[0] * s1, y1 = y2 + L[0] * c1;
        double X = L[0] * (c[2] * c2 - c[3] * s2), h = m[1] * L[0] * (c[2] * s2 + c[3] * c2);
        M22 = I[1] + m[1] * (c[2] * c[2] + c[3] * c[3]), M12 = M22 + m[1] * X;
        M11 = I[0] + m[0] * (c[0] * c[0] + c[1] * c[1]) + m[1] * L[0] * L[0] + 2 * m[1] * X + M22;
        M11 += armature[0], M22 += armature[1];
        C = {-h * (2 * w[0] + w[1]) * w[1], h * w[0] * w[0]};
        G[1] = -g[0] * m[1] * (c[2] * c12 - c[3] * s12);
        G[0] = -g[0] * (m[0] * (c[0] * c1 - c[1] * s1) + m[1] * L[0] * c1) + G[1];
        for (int k : {0, 1})
            R[k] = C[k] + G[k] + damping[k] * w[k] + friction[k] * ((w[k] > 0) - (w[k] < 0));
    }

    Numbers forward() const {
        double r1 = tau[0] - R[0], r2 = tau[1] - R[1], det = M11 * M22 - M12 * M12;
        return {(M22 * r1 - M12 * r2) / det, (M11 * r2 - M12 * r1) / det};
    }
    Numbers acceleration() const {
        double v1 = chain.L[0] * w[0] * w[0], v2 = chain.L[1] * (w[0] + w[1]) * (w[0] + w[1]);
        return {x1 * a[0] + x2 * a[1] - c1 * v1 - c12 * v2, y1 * a[0] + y2 * a[1] - s1 * v1 - s12 * v2};
    }
    double potential() const {
        const auto& [m, L, c, I, g, damping, friction, armature] = chain;
        return -g[0] * (m[0] * (c[0] * s1 + c[1] * c1) + m[1] * (L[0] * s1 + c[2] * s12 + c[3] * c12));
    }
};

static const std::map<std::string, std::function<Numbers(const State&)>> quantities = {
    {"mass_matrix", [](const State& s) -> Numbers { return {s.M11, s.M12, s.M12, s.M22}; }},
    {"velocity_terms", [](const State& s) -> Numbers { return {s.C[0], s.C[1]}; }},
    {"gravity_terms", [](const State& s) -> Numbers { return {s.G[0], s.G[1]}; }},
    {"inverse_dynamics", [](const State& s) -> Numbers {
        return {s.M11 * s.a[0] + s.M12 * s.a[1] + s.R[0], s.M12 * s.a[0] + s.M22 * s.a[1] + s.R[1]}; }},
    {"forward_dynamics", [](const State& s) { return s.forward(); }},
    {"kinetic_energy", [](const State& s) -> Numbers {
        return {(s.M11 * s.w[0] * s.w[0] + s.M22 * s.w[1] * s.w[1]) / 2 + s.M12 * s.w[0] * s.w[1]}; }},
    {"potential_energy", [](const State& s) -> Numbers { return {s.potential()}; }},
    {"position", [](const State& s) -> Numbers { return {s.y1, -s.x1}; }},
    {"velocity", [](const State& s) -> Numbers {
        return {s.x1 * s.w[0] + s.x2 * s.w[1], s.y1 * s.w[0] + s.y2 * s.w[1]}; }},
    {"acceleration", [](const State& s) { return s.acceleration(); }},
    {"jacobian", [](const State& s) -> Numbers { return {s.x1, s.x2, s.y1, s.y2}; }},
};

static void start() {
    std::string names;
    for (const auto& [name, _] : quantities) names += (names.empty() ? "\"" : ", \"") + name + "\"";
    std::printf("{\"version\": 1, \"engine\": {\"name\": \"closed form in C++\", \"version\": \"1\","
                " \"language\": \"c++\", \"reads\": [\"parameters\"], \"answers\": [%s], \"effects\":"
                " [\"joint_damping\", \"joint_friction\", \"armature\"]}}\n", names.c_str());
}

static void ask(const std::string& line) {
    int seq = static_cast<int>(numbers(line, "seq").at(0));
    auto found = quantities.find(word(line, "quantity"));
    if (found == quantities.end()) {
        std::printf("{\"seq\": %d, \"skipped\": true, \"message\": \"not implemented\"}\n", seq);
        return;
    }
    Numbers t = numbers(line, "angles"), w = numbers(line, "speeds");
    Numbers a = numbers(line, "accelerations"), tau = numbers(line, "torques");
    for (auto* each : {&w, &a, &tau}) each->resize(t.size());
    std::printf("{\"seq\": %d, \"values\": [", seq);
    for (std::size_t k = 0; k < t.size(); k += 2) {
        auto pair = [k](const Numbers& from) { return Pair{from[k], from[k + 1]}; };
        Numbers out = found->second(State(pair(t), pair(w), pair(a), pair(tau)));
        const char* form = out.size() == 1 ? "%s%.17g" : out.size() == 2 ? "%s[%.17g, %.17g]"
                                           : "%s[[%.17g, %.17g], [%.17g, %.17g]]";
        out.resize(4);
        std::printf(form, k ? ", " : "", out[0], out[1], out[2], out[3]);
    }
    std::puts("]}");
}

int main() {
    for (std::string line; std::getline(std::cin, line); std::fflush(stdout)) {
        const std::string cmd = word(line, "cmd");
        if (cmd == "stop") break;
        if (cmd == "start") start();
        if (cmd == "ask") ask(line);
        if (cmd != "model") continue;
        chain = {numbers(line, "mass"), numbers(line, "length"), numbers(line, "centre"),
                 numbers(line, "inertia"), numbers(line, "gravity"), numbers(line, "damping"),
                 numbers(line, "friction"), numbers(line, "armature")};
        bool sound = chain.m.size() == 2 && chain.m[0] > 0 && chain.m[1] > 0;
        std::puts(sound ? "{\"ok\": true}" : "{\"refused\": \"masses must be positive\"}");
    }
}
