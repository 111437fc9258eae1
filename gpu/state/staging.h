// The arrays of a DeviceView in the host's memory: what a load is turned into before it is uploaded, and what a
// download is turned into states from. The host backend works on them directly.
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
  std::optional<Element> unset;
};
inline constexpr std::nullopt_t none = std::nullopt;

// Elements that nobody has given a value are what the memory holds: making room costs no time, and no memory either
// where there is much.
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
  // bare: elements of arrays whose unset is `none` are left as memory comes; else they are zero.
  void allocate(bool bare = false);

  // A DeviceView over these vectors.
  DeviceView view();
};

// load.cpp. Arrays as long as what the load puts into them. Requires setups.size() == states.size(); throws
// std::invalid_argument if a state does not fit its setup, and MachineError if an index would not fit into 32 bits.
StagingBuffers make_contents(const std::vector<Setup>& setups, const std::vector<State>& states, Capacity capacity);
// The same with all arrays allocated.
StagingBuffers make_staging_buffers(const std::vector<Setup>& setups, const std::vector<State>& states,
                                    Capacity capacity);

// extract.cpp. The inverse of make_staging_buffers, after kernels have worked on it. Skin vertices come in the order
// (owner, direction), triangles in the order of their cells.
std::vector<State> extract_states(const StagingBuffers& staging, const std::vector<Setup>& setups);
// Only of the bodies that are wanted; the others' states are empty. `skins`: what an earlier call has found for bodies
// whose skin stage has not run since; filled where it is empty.
using KnownSkins = std::vector<std::optional<Skin>>;
std::vector<State> extract_states(const StagingBuffers& staging, const std::vector<Setup>& setups,
                                  const std::vector<bool>& wanted, KnownSkins& skins);

// How the last substep of a step moved the particles that are alive: how many of them by their group's map alone; by
// it, in a grip; one by one, because something may touch their group; one by one, because they are in no group.
struct StepWork {
  int64_t carried = 0, held = 0, resolved = 0, loose = 0;
  int64_t groups = 0;  // of the first three

  friend bool operator==(const StepWork&, const StepWork&) = default;
};
// extract.cpp. From what the step leaves: of each group its head, and of each whether it is resolved (null: nothing can
// touch any); the list of loose places.
StepWork step_work_of(const Counters& counters, const GroupHead* heads, const int* resolved, const int* loose_places);

// capacity.cpp. The extents of what has been loaded, whose arrays are as long as their contents. Throws MachineError if
// one is beyond 32 bits.
Extents extents_of(const StagingBuffers& loaded, Capacity capacity);
// What of these has been given out: as long is what a state is made from.
Extents in_use(const Extents& extents, const Counters& counters);
// How many bytes of arrays that are at least so long [bytes] a load puts nothing into.
std::size_t empty_bytes(StagingBuffers& contents, std::size_t of_arrays);
// Something is at least three quarters full, so the next load should have more capacity.
bool wants_capacity(const Extents& extents, const Counters& counters);
// Throws MachineError if a capacity was too small for a stage.
void require_no_fault(const Counters& counters);

}  // namespace cutproof::gpu
