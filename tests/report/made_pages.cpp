// Writes the page of a made run: a block of n × n × n particles that is bent to and fro, with a skin around it, so that
// pages of runs that nobody simulates for a test can be weighed and timed.
// Usage: made_pages N FRAMES PARTICLES_EVERY OUT: particles move in every so many frames, the skin in each.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "model/at.h"
#include "report/page.h"
#include "tests/report/made_run.h"

namespace {

using namespace cutproof;

// A number in [-1, 1] that nothing compresses away (splitmix64; G. Steele, D. Lea, C. Flood, OOPSLA 2014).
double noise(uint64_t key) {
  key += 0x9E3779B97F4A7C15u;
  key = (key ^ key >> 30) * 0xBF58476D1CE4E5B9u;
  key = (key ^ key >> 27) * 0x94D049BB133111EBu;
  return static_cast<double>((key ^ key >> 31) >> 11) * 0x1p-52 - 1;
}

// Bends the block in a wave that grows, and shakes each particle a little by itself, so that a page of this is about as
// large as one of a simulated body.
Vec3 bent(Vec3 p, double frame, double size, uint64_t particle) {
  const double phase = 6 * p.x / size + 0.11 * frame;
  const auto shaken = [&](uint64_t axis) {
    return 0.002 * report::kSpacing * noise(3 * (1'000'003 * static_cast<uint64_t>(frame) + particle) + axis);
  };
  return {p.x + 0.03 * size * std::sin(phase + p.z / size) + shaken(0), p.y + 0.01 * size * std::cos(phase) + shaken(1),
          p.z + 0.06 * size * std::sin(phase) * std::min(1.0, frame / 20) + shaken(2)};
}

// Two triangles to each square of the block's sides; a vertex for each particle there.
Skin skin_around(const Setup& setup, int32_t n) {
  Skin skin;
  std::vector<int32_t> vertex(setup.body.mass.size(), -1);
  const auto particle = [&](int32_t i, int32_t j, int32_t k) { return i + n * (j + n * k); };
  const auto corner = [&](int32_t p) {
    if (vertex[at(p)] < 0) {
      vertex[at(p)] = static_cast<int32_t>(skin.owner.size());
      skin.owner.push_back(p);
      skin.direction.push_back(0);
      skin.reach.push_back(0.5);
    }
    return vertex[at(p)];
  };
  for (int side = 0; side < 6; ++side) {
    for (int32_t a = 0; a + 1 < n; ++a) {
      for (int32_t b = 0; b + 1 < n; ++b) {
        const auto place = [&](int32_t u, int32_t v) {
          const int32_t w = side % 2 == 0 ? 0 : n - 1;
          return corner(side < 2 ? particle(w, u, v) : side < 4 ? particle(v, w, u) : particle(u, v, w));
        };
        std::array<int32_t, 4> c = {place(a, b), place(a + 1, b), place(a + 1, b + 1), place(a, b + 1)};
        if (side % 2 == 0) std::swap(c[1], c[3]);
        skin.triangles.push_back({c[0], c[1], c[2]});
        skin.triangles.push_back({c[0], c[2], c[3]});
      }
    }
  }
  return skin;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: made_pages N FRAMES PARTICLES_EVERY OUT\n");
    return 2;
  }
  const int32_t n = std::atoi(argv[1]), frames = std::atoi(argv[2]), every = std::atoi(argv[3]);
  if (n < 2 || frames < 1 || every < 1) {
    std::fprintf(stderr, "made_pages: N is 2 or more, FRAMES and PARTICLES_EVERY are 1 or more\n");
    return 2;
  }
  const Setup setup = report::block(n);
  const Skin skin = skin_around(setup, n);
  const double size = n * report::kSpacing;
  const report::Source source = {setup, frames + 1, [&](int64_t index) {
                                   io::Snapshot snapshot = {Stage::skin, report::at_rest(setup.body)};
                                   State& state = snapshot.state;
                                   state.frame = index;
                                   const auto moved = static_cast<double>(index - index % every);
                                   for (std::size_t i = 0; i < state.x.size(); ++i)
                                     state.x[i] = bent(state.x[i], moved, size, i);
                                   state.skin = skin;
                                   for (const int32_t owner : skin.owner) {
                                     state.skin.position.push_back(bent(setup.body.rest_position(owner),
                                                                        static_cast<double>(index), size, at(owner)));
                                   }
                                   return snapshot;
                                 }};
  report::Results results;
  results.command = "recording";
  results.scene = "a bent block";
  results.backend = "made";
  std::ofstream(argv[4]) << report::page(source, results, "cutproof check made", {"1"});
  std::printf("%d particles, %zu triangles, %d frames\n", setup.body.particle_count(), skin.triangles.size(), frames);
}
