// The arrays of a DeviceView in host memory: the form of a load before upload and of a download before extraction. The
// host backend works on them directly.
#pragma once
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <utility>
#include <vector>

#include "gpu/state/device_view.h"
#include "model/setup.h"
#include "model/state.h"

namespace cutproof::gpu {

// Sizes of arrays relative to their contents at load. Factors apply to slots and members; skin and additions are sized
// from the particles.
struct Capacity {
  double factor = 1;  // of the most that a first cut needs; doubled whenever an array becomes three quarters full
};

// The lifetimes of arrays.inc.
enum class Lifetime { constant, state, derived, scratch };
template <class Element>
struct Array {
  const char* name;
  int64_t extent;
  Lifetime lifetime;
  std::optional<Element> unset;
};
inline constexpr std::nullopt_t none = std::nullopt;

// New elements are left uninitialised, so allocation takes no time, and large arrays take no memory until used.
template <class Element>
struct BareAllocator : std::allocator<Element> {
  template <class Other>
  struct rebind {
    using other = BareAllocator<Other>;
  };
  template <class Made, class... Args>
  void construct(Made* at, Args&&... args) {
    if constexpr (sizeof...(Args) > 0) ::new (static_cast<void*>(at)) Made(std::forward<Args>(args)...);
  }
};
template <class Element>
using Elements = std::vector<Element, BareAllocator<Element>>;

struct StagingBuffers : Extents {
#define ARRAY(name, Element, extent, lifetime, unset) Elements<Element> name;
#include "gpu/state/arrays.inc"

  // Skins as loaded, returned until a skin stage has made a body's own.
  std::vector<Skin> loaded_skin;

  // Calls visit(array, vector, pointer in `view`) for every array.
  template <class Visit>
  void each(DeviceView& view, Visit&& visit) {
#define ARRAY(name, Element, extent, lifetime, unset) \
  visit(Array<Element>{#name, int64_t{extent}, Lifetime::lifetime, unset}, name, view.name);
#include "gpu/state/arrays.inc"
  }

  // Gives every array its extent. Present elements stay; those beyond an extent are lost. New elements are unset. bare:
  // elements of arrays whose unset is `none` are uninitialised; else they are zero.
  void allocate(bool bare = false);

  // A DeviceView over these vectors.
  DeviceView view();
};

// load.cpp. Arrays as long as a load's contents. Requires setups.size() == states.size(). Throws std::invalid_argument
// if a state does not fit its setup, and MachineError if an index would not fit into 32 bits.
StagingBuffers make_contents(const std::vector<Setup>& setups, const std::vector<State>& states, Capacity capacity);
// The same with all arrays allocated.
StagingBuffers make_staging_buffers(const std::vector<Setup>& setups, const std::vector<State>& states,
                                    Capacity capacity);

// extract.cpp. The inverse of make_staging_buffers, after kernels have worked on it. Skin vertices have the order
// (owner, direction), triangles that of their cells.
std::vector<State> extract_states(const StagingBuffers& staging, const std::vector<Setup>& setups);
// Only of the wanted bodies; other states are empty. `skins`: results of earlier calls for bodies whose skin stage has
// not run since; filled where empty.
using KnownSkins = std::vector<std::optional<Skin>>;
std::vector<State> extract_states(const StagingBuffers& staging, const std::vector<Setup>& setups,
                                  const std::vector<bool>& wanted, KnownSkins& skins);

// How the last substep of a step moved living particles: by their group's map alone; by it, in a grip; one by one,
// because a contact may touch their group; one by one, because they are in no group.
struct StepWork {
  int64_t carried = 0, held = 0, resolved = 0, loose = 0;
  int64_t groups = 0;  // of the first three

  friend bool operator==(const StepWork&, const StepWork&) = default;
};
// extract.cpp. From the step's arrays: each group's head and whether it is resolved (null: no contacts); the list of
// loose places.
StepWork step_work_of(const Counters& counters, const GroupHead* heads, const int* resolved, const int* loose_places);

// capacity.cpp. Extents for loaded bodies, whose arrays are as long as their contents. Throws MachineError if one is
// beyond 32 bits.
Extents extents_of(const StagingBuffers& loaded, Capacity capacity);
// The used part of these extents; states are made from it.
Extents in_use(const Extents& extents, const Counters& counters);
// Bytes that a load leaves empty in arrays of at least `of_arrays` bytes.
std::size_t empty_bytes(StagingBuffers& contents, std::size_t of_arrays);
// At least three quarters of some capacity are used, so the next load should have more.
bool wants_capacity(const Extents& extents, const Counters& counters);
// Throws MachineError if a capacity was too small for a stage.
void require_no_fault(const Counters& counters);

}  // namespace cutproof::gpu
