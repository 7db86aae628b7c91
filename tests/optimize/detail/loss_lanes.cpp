// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/optimize/detail/loss_lanes.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

struct own {
  double cost(double s) const { return s / (1.0 + s); }
  double weight(double s) const { return 1.0 / ((1.0 + s) * (1.0 + s)); }
};

template <class Loss>
void check(const Loss& loss) {
  using lanes = simd::vec<double, 8, simd::portable>;
  double s[8], cost[8], weight[8];
  for (double base = 0.0; base < 1e12; base = 1.7 * base + 0.01) {
    for (int i = 0; i != 8; ++i) s[i] = base * (1.0 + 0.07 * i);
    lanes c, w;
    optimize::detail::lanes_of_loss<Loss>::weigh(loss, lanes::load(s), c, w);
    c.store(cost);
    w.store(weight);
    for (int i = 0; i != 8; ++i) {
      CHECK(std::abs(cost[i] - loss.cost(s[i])) <= 1e-14 * loss.cost(s[i]));
      CHECK(std::abs(weight[i] - loss.weight(s[i])) <= 1e-14);
    }
  }
}

}  // namespace

TEST_CASE("Every loss on lanes is what it is on numbers") {
  check(optimize::trivial{});
  check(optimize::huber{2.45});
  check(optimize::cauchy{1.5});
  check(optimize::tukey{4.0});
  check(own{});
}
