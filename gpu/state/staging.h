// The arrays of a DeviceView in the host's memory: what a load is turned into before it is uploaded, and what a
// download is turned into states from. The host backend works on them directly.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "gpu/state/device_view.h"
#include "model/setup.h"
#include "model/state.h"

namespace cutproof::gpu {

// How much larger the arrays are than what is in them at load. Factors apply to slots and members; skin and additions
// are sized from the particles.
struct Capacity {
  double factor = 1;  // of what a first cut needs at most; doubled each time something has become three quarters full
};

// What arrays.inc says of an array.
enum class Lifetime { constant, state, derived, scratch };
template <class Element>
struct Array {
  const char* name;
  int64_t extent;
  Lifetime lifetime;
  Element unset;
};

struct StagingBuffers : Extents {
#define ARRAY(name, Element, extent, lifetime, unset) std::vector<Element> name;
#include "gpu/state/arrays.inc"

  int rotation_method = kJacobi4;
  // Skins as loaded: given back until a skin stage has made a body's own.
  std::vector<Skin> loaded_skin;

  // Calls visit(array, vector, pointer in `view`) for every array.
  template <class Visit>
  void each(DeviceView& view, Visit&& visit) {
#define ARRAY(name, Element, extent, lifetime, unset) \
  visit(Array<Element>{#name, int64_t{extent}, Lifetime::lifetime, unset}, name, view.name);
#include "gpu/state/arrays.inc"
  }

  // Gives every array its extent. What is there stays, and new elements are unset; those beyond an extent are lost.
  void allocate();

  // A DeviceView over these vectors.
  DeviceView view();
};

// load.cpp. Requires setups.size() == states.size(); throws std::invalid_argument if a state does not fit its setup,
// and MachineError if an index would not fit into 32 bits.
StagingBuffers make_staging_buffers(const std::vector<Setup>& setups, const std::vector<State>& states,
                                    int rotation_method, Capacity capacity);

// extract.cpp. The inverse of make_staging_buffers, after kernels have worked on it. Skin vertices come in the order
// (owner, direction), triangles in the order of their cells.
std::vector<State> extract_states(const StagingBuffers& staging, const std::vector<Setup>& setups);
// Only of the bodies that are wanted; the others' states are empty. `skins`: what an earlier call has found for bodies
// whose skin stage has not run since; filled where it is empty.
using KnownSkins = std::vector<std::optional<Skin>>;
std::vector<State> extract_states(const StagingBuffers& staging, const std::vector<Setup>& setups,
                                  const std::vector<bool>& wanted, KnownSkins& skins);

// capacity.cpp. The extents of what has been loaded, whose arrays are as long as their contents. Throws MachineError if
// one is beyond 32 bits.
Extents extents_of(const StagingBuffers& loaded, Capacity capacity);
// Something is at least three quarters full, so the next load should have more capacity.
bool wants_capacity(const Extents& extents, const Counters& counters);
// Throws MachineError if a capacity was too small for a stage.
void require_no_fault(const Counters& counters);

}  // namespace cutproof::gpu
