/* Enclosures of boxes by Ariadne, for boxes.py: the ball on a moving table in the gap y, its rate u and the phase s.

Reads boxes of impacts, "low high" of speed and of phase, until the input ends. Prints for each box and each number of impacts the
ends of speed and phase just before the last impact, as the box about Ariadne's sets and as that about 64 parts of each, and seconds
of processor time. */
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "function/taylor_function.hpp"
#include "hybrid/discrete_location.hpp"
#include "hybrid/hybrid_automata.hpp"
#include "hybrid/hybrid_evolver.hpp"
#include "hybrid/hybrid_orbit.hpp"
#include "hybrid/hybrid_set.hpp"
#include "hybrid/hybrid_time.hpp"

using namespace Ariadne;

static Real real(double x) { return Real(ExactDouble(x)); }

struct Hull {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};

    /* Of a set, halved so many times along its last two parameters. */
    void extend(HybridEnclosure const& set, int halvings) {
        if (halvings > 0) {
            auto domain = set.parameter_domain();
            const auto i = set.number_of_parameters() - 1 - halvings % 2;
            FloatDP a = domain[i].lower_bound(), b = domain[i].upper_bound(), m(ExactDouble((a.get_d() + b.get_d()) / 2), dp);
            for (auto half : {ExactIntervalType(a, m), ExactIntervalType(m, b)}) {
                domain[i] = half;
                HybridEnclosure part = set;
                part.restrict(domain);
                extend(part, halvings - 1);
            }
            return;
        }
        auto box = set.state_bounding_box();
        for (int i = 0; i < 2; ++i) {
            auto side = box[set.state_space().index(RealVariable(i ? "s" : "u"))];
            low[i] = std::min(low[i], side.lower_bound().get_d());
            high[i] = std::max(high[i], side.upper_bound().get_d());
        }
    }

    void print() const { printf("%.17g %.17g %.17g %.17g ", 2 * low[0], 2 * high[0], low[1], high[1]); }
};

int main(int, char** given) {
    const double accuracy = atof(given[1]);
    const int impacts = atoi(given[2]), turns = atoi(given[3]);
    RealVariable y("y"), u("u"), s("s");
    DiscreteLocation flight;
    DiscreteEvent impact("impact");
    HybridAutomaton ball;
    ball.new_mode(flight, {dot(y) = u, dot(u) = real(1.75) * sin(s) - 1, dot(s) = 1});
    ball.new_transition(flight, impact, flight, {next(y) = 0, next(u) = real(-0.5) * u, next(s) = s}, y <= 0, EventKind::IMPACT);
    GeneralHybridEvolver evolver(ball, ValidatedFunctionPatchFactory(
        new TaylorFunctionFactory(ThresholdSweeper<FloatDP>(dp, accuracy / 100))));
    evolver.configuration().set_flow_accuracy(accuracy);
    double v[2], phi[2];
    while (scanf("%lf %lf %lf %lf", v, v + 1, phi, phi + 1) == 4) {
        HybridBoundedConstraintSet start(
            flight, {0 <= y <= 0, real(v[0] / 2) <= u <= real(v[1] / 2), real(phi[0]) <= s <= real(phi[1])});
        for (int k = 1; k <= impacts; ++k) {
            double best = INFINITY;
            Hull whole, parts;
            for (int turn = 0; turn < turns; ++turn) {
                const clock_t begin = clock();
                auto orbit = evolver.orbit(start, HybridTime(1000, k), Semantics::UPPER);
                for (auto const& set : orbit.final()) {
                    whole.extend(set, 0);
                    parts.extend(set, 6);
                }
                best = std::min(best, double(clock() - begin) / CLOCKS_PER_SEC);
            }
            whole.print();
            parts.print();
            printf("%.17g\n", best);
        }
    }
}
