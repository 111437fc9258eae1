#include "harness/promises.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "model/error.h"
#include "model/words.h"
#include "oracles/runs/run.h"

namespace cutproof::harness {

namespace {

constexpr std::array kConnected = {std::string_view("cluster connectivity"),
                                   std::string_view("no coupling across pieces")};
constexpr std::array kCovered = {std::string_view("coverage")};
constexpr std::array kCoupled = {std::string_view("component match"), std::string_view("isolation")};
constexpr std::array kEdgesCovered = {std::string_view("edge cover")};
constexpr std::array kCapKept = {std::string_view("cap kept")};
constexpr std::array kMaximal = {std::string_view("merge maximality")};
constexpr std::array kTissueKept = {std::string_view("tissue kept")};
constexpr std::array kRestFrames = {std::string_view("rest frames")};
constexpr std::array kRotations = {std::string_view("rotation"), std::string_view("rotation match")};
constexpr std::array kMomentum = {std::string_view("linear momentum"), std::string_view("component momentum"),
                                  std::string_view("centre of mass")};
constexpr std::array kMotion = {std::string_view("motion"), std::string_view("admissible step"),
                                std::string_view("step by iterates")};
constexpr std::array kBladeOut = {std::string_view("no pass")};
constexpr std::array kSkin = {std::string_view("skin match"),     std::string_view("skin surface"),
                              std::string_view("skin vertices"),  std::string_view("skin shells"),
                              std::string_view("skin geometry"),  std::string_view("skin reach"),
                              std::string_view("surface"),        std::string_view("surface vertices"),
                              std::string_view("surface places"), std::string_view("surface shells")};
constexpr std::array kFreeSkin = {std::string_view("skin match"),     std::string_view("skin surface"),
                                  std::string_view("skin shells"),    std::string_view("surface"),
                                  std::string_view("surface places"), std::string_view("surface shells")};
constexpr std::array kBest = {std::string_view("best rotation")};
constexpr std::array kNearest = {std::string_view("nearest rotation")};
constexpr std::array kKeepsPrevious = {std::string_view("previous rotation kept")};
constexpr std::array kSameBits = {std::string_view("determinism"), std::string_view("span composition")};
constexpr std::array kNoGhostForce = {std::string_view("no ghost force"), std::string_view("the kick was felt")};
constexpr std::array kMirror = {std::string_view("mirrored run")};

constexpr std::array kWords = {
    PromiseWord{"connected", "each cluster is connected tissue", kConnected},
    PromiseWord{"covered", "each alive particle lies in a cluster, and no dead one does", kCovered},
    PromiseWord{"coupled", "shared particles couple tissue exactly where it is connected", kCoupled},
    PromiseWord{"edges_covered", "both ends of each edge of the tissue lie in one cluster", kEdgesCovered},
    PromiseWord{"cap_kept", "no merged cluster has more particles than the cap", kCapKept},
    PromiseWord{"maximal", "no small cluster is left that could still merge", kMaximal},
    PromiseWord{"tissue_kept", "only cut tissue is removed", kTissueKept},
    PromiseWord{"rest_frames", "rest centers and masses of clusters follow from their members", kRestFrames},
    PromiseWord{"rotations", "each rotation is orthogonal and fits the particles of its cluster", kRotations},
    PromiseWord{"best", "no rotation fits better", kBest},
    PromiseWord{"nearest", "of several best rotations, the one nearest to the previous rotation", kNearest},
    PromiseWord{"keeps_previous", "an undetermined rotation keeps its previous value", kKeepsPrevious},
    PromiseWord{"momentum", "momentum, also of each piece, changes only by external forces", kMomentum},
    PromiseWord{"motion", "a step ends at the result of the method's equations, within rounding", kMotion},
    PromiseWord{"blade_out", "no tissue stands across the blade", kBladeOut},
    PromiseWord{"skin", "the skin is a closed surface around each piece, and where the tissue is", kSkin},
    PromiseWord{"free_skin", "as skin, with vertices anywhere in the cells that it crosses (dual methods)", kFreeSkin},
    PromiseWord{"same_bits", "the same input gives the same bits", kSameBits},
    PromiseWord{"no_ghost_force", "a piece that is kicked moves no other piece", kNoGhostForce},
    PromiseWord{"mirror", "a mirrored scene gives the mirrored run", kMirror},
};

}  // namespace

std::span<const PromiseWord> promise_words() { return kWords; }

namespace {

bool is_given(uint32_t words, std::string_view name) {
  const auto found = std::find_if(kWords.begin(), kWords.end(), [&](const PromiseWord& w) { return w.name == name; });
  return (words >> (found - kWords.begin()) & 1u) != 0;
}

}  // namespace

bool Promises::free_skin_places() const { return is_given(words, "free_skin") && !is_given(words, "skin"); }

bool Promises::cover(std::string_view property) const {
  bool named = false;
  for (std::size_t k = 0; k < kWords.size(); ++k) {
    const auto& properties = kWords[k].properties;
    if (std::find(properties.begin(), properties.end(), property) == properties.end()) continue;
    if ((words >> k & 1u) != 0) return true;
    named = true;
  }
  return !named;
}

uint32_t parse_promises(std::string_view text, const std::string& file, const std::string& field) {
  if (text == "*") return Promises{}.words;
  uint32_t bits = 0;
  for (const std::string_view word : words_in(text)) {
    const auto found = std::find_if(kWords.begin(), kWords.end(), [&](const PromiseWord& w) { return w.name == word; });
    if (found == kWords.end()) {
      constexpr const auto& of_runs = oracles::kRunPromises;
      if (std::find(of_runs.begin(), of_runs.end(), word) != of_runs.end()) continue;
      std::string known;
      for (const PromiseWord& each : kWords) known += std::string(each.name) + ", ";
      throw InputError(file, field, fmt::format("there is no promise '{}'", word),
                       fmt::format("give words of these, separated by spaces: {}{}", known, fmt::join(of_runs, ", ")));
    }
    bits |= 1u << static_cast<unsigned>(found - kWords.begin());
  }
  return bits;
}

}  // namespace cutproof::harness
