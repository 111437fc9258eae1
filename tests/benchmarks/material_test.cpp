// `cutproof bench material`: what bars have is what their material says, where clusters are small beside the bar.
#include "benchmarks/material.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "benchmarks/suites/suites.h"
#include "harness/backends.h"
#include "model/error.h"

namespace cutproof::benchmarks::material_test {
namespace {

struct Bar {
  std::unique_ptr<Backend> backend = harness::make_backend({"host"});
  MaterialBar bar;
  explicit Bar(const BarSpec& spec) : bar(*backend, spec) {}
  MaterialBar* operator->() { return &bar; }
};

// A bar hangs as the formula of the method says, but where it is held.
TEST(MaterialBars, HaveTheModuliOfTheirMaterial) {
  for (const double nu : {0.0, 0.45}) {
    Bar bar({.poisson_ratio = nu, .across = 7});
    const std::vector<MaterialFigure> hung = bar->hang();
    EXPECT_NEAR(hung.at(0).measured / hung.at(0).asked, 1, nu == 0 ? 1e-3 : 0.03) << nu;
    EXPECT_NEAR(hung.at(1).measured, nu, 0.02);
    const MaterialFigure volume = bar->pull();
    EXPECT_NEAR(volume.measured, volume.asked, 0.01) << nu;
    EXPECT_NEAR(volume.asked, nu == 0 ? 1.2 : 1.02, 0.01);
  }
}

TEST(MaterialBars, SwingAndDecayAsTheyShould) {
  for (const std::string along : {"100", "111"}) {
    Bar bar({.along = along, .across = 7});
    for (const MaterialFigure& one : {bar->swing_along(), bar->swing_across()}) {
      EXPECT_GT(one.measured / one.asked, 0.95) << along << " " << one.test;
      EXPECT_LT(one.measured / one.asked, along == "100" ? 1.05 : 1.3) << along << " " << one.test;
    }
    const MaterialFigure decay = bar->decay();
    EXPECT_NEAR(decay.measured / decay.asked, 1, 0.02) << along;
  }
}

// A twist is not affine within a cluster, so an error of second order is left: the same for all ν, because β does not
// resist it.
TEST(MaterialBars, TwistAsStifflyWhateverTheirPoissonRatio) {
  const auto excess = [](int32_t across, double nu) {
    Bar bar({.poisson_ratio = nu, .across = across});
    const MaterialFigure twist = bar->twist();
    return twist.measured / twist.asked - 1;
  };
  const double coarse = excess(5, 0.45), fine = excess(9, 0.45);
  EXPECT_LT(fine, 0.2);
  EXPECT_NEAR(std::log2(coarse / fine), 2, 0.6);
  EXPECT_NEAR(excess(9, 0), fine, 0.03);
}

TEST(MaterialBars, AreSofterAfterFewIterations) {
  double last = 0;
  for (const int32_t iterations : {1, 2, 4}) {
    Bar bar({.across = 7, .iterations = iterations});
    const MaterialFigure one = bar->swing_along();
    EXPECT_NEAR(one.measured / one.asked, 1, 0.05) << iterations;
    EXPECT_GT(one.asked, last);
    last = one.asked;
  }
  EXPECT_LT(last, 0.99e4);
}

TEST(MaterialBars, AreRowsOfTheSuite) {
  MaterialOptions options{.backend = "host", .sides = {2}, .poisson_ratios = {0.3}, .across = {4}, .iterations = {2}};
  const nlohmann::json document = run_material(options, [](const nlohmann::json&) {});
  EXPECT_EQ(document.at("rows").size(), document.at("rows_at_most"));
  options.sides = {20};
  EXPECT_THROW(run_material(options, [](const nlohmann::json&) {}), InputError) << "one cluster";
  options.along = {"101"};
  try {
    run_material(options, [](const nlohmann::json&) {});
    FAIL() << "it was taken";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("'101' is no axis of a bar"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace cutproof::benchmarks::material_test
