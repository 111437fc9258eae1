// What somebody vouches for. A rule (model/rules.h), a scene, a plugin or the author of a state promises properties;
// what nobody promises is not judged, and reports say so (Judge::unpromised), never that it holds.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace cutproof::harness {

// A promise that guests make by name, and the properties (oracles/registry.h) that it stands for.
struct PromiseWord {
  std::string_view name;  // as in files and plugins
  std::string_view text;  // what is promised, in a sentence
  std::span<const std::string_view> properties;
};
// In the order in which people read about them. Properties that no word names are asked of everybody: that what was
// handed over can be read, and that a stage changes nothing that is not its own.
std::span<const PromiseWord> promise_words();

struct Promises {
  // Connected tissue is coupled. Only rules that keep I4 promise it (method.md §2); a scene that was written down
  // promises it unless it expects otherwise.
  bool coupling_without_edge_cover = true;
  // No small cluster could still merge, also after an expansion: clusters that have grown may touch others that they
  // did not touch, so this is the promise of the merge stage alone.
  bool maximality_after_expansion = true;
  // Words that are given, by their index in promise_words(), as bits.
  uint32_t words = ~uint32_t{0};

  // Whether a word that names this property is given, or none names it.
  bool cover(std::string_view property) const;
  // Skin vertices lie anywhere within the cells that the surface passes: "free_skin" is given, and not "skin".
  bool free_skin_places() const;
};
// What the rules of a setup promise whatever clusters a body was given.
inline constexpr Promises kPromisesOfRules = {.coupling_without_edge_cover = false,
                                              .maximality_after_expansion = false};

// Words separated by spaces, as bits; "*": all. Throws InputError, naming `file` and `field`, for a word that there is
// not, and names those that there are. Words of runs alone (oracles/runs/run.h) have no bit.
uint32_t parse_promises(std::string_view text, const std::string& file, const std::string& field);

}  // namespace cutproof::harness
