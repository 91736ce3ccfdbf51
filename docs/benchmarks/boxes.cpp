/* Enclosures of boxes by Ariadne, for boxes.py: the ball on a moving table in the gap y, its rate u and the phase s.

Reads boxes of impacts, "low high" of speed and of phase, until the input ends. Prints for each box and each number of impacts
the ends of speed and phase just before the last impact, the number of sets they consist of, and seconds of processor time. */
#include <algorithm>
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

int main(int, char** given) {
    const double longest = atof(given[1]), accuracy = atof(given[2]);
    const int impacts = atoi(given[3]), turns = atoi(given[4]);
    RealVariable y("y"), u("u"), s("s");
    DiscreteLocation flight;
    DiscreteEvent impact("impact");
    HybridAutomaton ball;
    ball.new_mode(flight, {dot(y) = u, dot(u) = real(1.75) * sin(s) - 1, dot(s) = 1});
    ball.new_transition(flight, impact, flight, {next(y) = 0, next(u) = real(-0.5) * u, next(s) = s}, y <= 0, EventKind::IMPACT);
    GeneralHybridEvolver evolver(ball, ValidatedFunctionPatchFactory(
        new TaylorFunctionFactory(ThresholdSweeper<FloatDP>(dp, accuracy))));
    evolver.configuration().set_maximum_step_size(longest);
    evolver.configuration().set_flow_accuracy(accuracy);
    double box[4];
    while (scanf("%lf %lf %lf %lf", box, box + 1, box + 2, box + 3) == 4) {
        HybridBoundedConstraintSet start(flight, {0 <= y <= 0, real(box[0] / 2) <= u <= real(box[1] / 2), real(box[2]) <= s <= real(box[3])});
        for (int k = 1; k <= impacts; ++k) {
            double best = INFINITY, low[2], high[2];
            int sets = 0;
            for (int turn = 0; turn < turns; ++turn) {
                std::fill_n(low, 2, INFINITY);
                std::fill_n(high, 2, -INFINITY);
                const clock_t begin = clock();
                auto orbit = evolver.orbit(start, HybridTime(1000, k), Semantics::UPPER);
                sets = 0;
                for (auto const& set : orbit.final()) {
                    auto found = set.state_bounding_box();
                    for (int i = 0; i < 2; ++i) {
                        auto side = found[set.state_space().index(i ? s : u)];
                        low[i] = std::min(low[i], side.lower_bound().get_d());
                        high[i] = std::max(high[i], side.upper_bound().get_d());
                    }
                    ++sets;
                }
                best = std::min(best, double(clock() - begin) / CLOCKS_PER_SEC);
            }
            printf("%.17g %.17g %.17g %.17g %d %.17g\n", 2 * low[0], 2 * high[0], low[1], high[1], sets, best);
            fflush(stdout);
        }
    }
}
