// Promises. A rule (model/rules.h), a scene, a plugin or the author of a state promises properties. A property without
// a promise is not judged; reports list it (Judge::unpromised).
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace cutproof::harness {

// A promise that guests make by name, and the properties (oracles/registry.h) that it stands for.
struct PromiseWord {
  std::string_view name;  // as in files and plugins
  std::string_view text;  // the promise, as a sentence
  std::span<const std::string_view> properties;
};
// In the order of documentation. Properties that no word names are always judged: a readable state, and stages that
// change only their own fields.
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
// Promises of a setup's rules for any clusters of a body.
inline constexpr Promises kPromisesOfRules = {.coupling_without_edge_cover = false,
                                              .maximality_after_expansion = false};

// Words separated by spaces, as bits; "*": all. Throws InputError, naming `file` and `field`, for a word that there is
// not, and names those that there are. Words of runs alone (oracles/runs/run.h) have no bit.
uint32_t parse_promises(std::string_view text, const std::string& file, const std::string& field);

}  // namespace cutproof::harness
