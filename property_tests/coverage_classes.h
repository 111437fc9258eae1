// Coverage classes of random cases, by name: a campaign without them says too little. For campaigns and their pages.
#pragma once
#include <array>

namespace cutproof::property_tests {

// In which campaigns a class of cases must occur. often: in at least one of ten cases that move, because faults of
// contacts show in one of hundreds of them only.
enum class Occurs { always, where_bodies_move, often_where_bodies_move };

struct CoverageClass {
  const char* name;
  Occurs occurs = Occurs::always;
};

// Coverage classes of a case.
inline constexpr std::array kCoverageClasses = {
    CoverageClass{"no particles"},
    CoverageClass{"one particle"},
    CoverageClass{"several components"},  // already before the first cut
    CoverageClass{"boxes"},
    CoverageClass{"sampled clusters"},
    CoverageClass{"tiles"},
    CoverageClass{"foreign clusters"},
    CoverageClass{"removal"},  // a cut took particles out
    CoverageClass{"miss"},     // a frame with the blade down removed nothing
    CoverageClass{"pen up"},
    CoverageClass{"retraced stroke"},
    CoverageClass{"zero length stroke"},
    CoverageClass{"blade of thickness 0"},
    CoverageClass{"oblique blade"},  // down, and its back along no axis
    CoverageClass{"turning blade"},  // down
    CoverageClass{"split"},          // a split made more clusters
    CoverageClass{"vanished cluster"},
    CoverageClass{"debris"},
    CoverageClass{"separation"},  // G has more components than before a cut
    CoverageClass{"merge"},
    CoverageClass{"expansion"},
    CoverageClass{"published merge"},
    CoverageClass{"published expansion"},
    CoverageClass{"uncoupled without promise"},  // connected tissue is, where no rule promises otherwise
    CoverageClass{"alpha"},                      // a skin whose vertices are not halfway
    CoverageClass{"fitted skin"},                // a skin of which each vertex has a place of its own on its edge
    CoverageClass{"cavity"},                     // the skin has an inner shell
    CoverageClass{"consumed body"},              // it is cut away entirely
    // Of steps, in which something moved.
    CoverageClass{"published solver", Occurs::where_bodies_move},
    CoverageClass{"accelerated solver", Occurs::where_bodies_move},
    CoverageClass{"damped", Occurs::where_bodies_move},
    CoverageClass{"retarded", Occurs::where_bodies_move},
    CoverageClass{"volume kept", Occurs::where_bodies_move},
    CoverageClass{"small dt", Occurs::where_bodies_move},
    CoverageClass{"large dt", Occurs::where_bodies_move},
    // Something was removed.
    CoverageClass{"cut at another epsilon", Occurs::where_bodies_move},
    CoverageClass{"one end of each edge", Occurs::where_bodies_move},
    CoverageClass{"nearer end of each edge", Occurs::where_bodies_move},
    CoverageClass{"cut by strain", Occurs::where_bodies_move},
    CoverageClass{"geometric cut of what moves", Occurs::where_bodies_move},
    // Touches (touching.h).
    CoverageClass{"grip", Occurs::where_bodies_move},
    CoverageClass{"grip released", Occurs::where_bodies_move},
    CoverageClass{"grip taken over", Occurs::where_bodies_move},
    CoverageClass{"wall", Occurs::often_where_bodies_move},
    CoverageClass{"wall that is no floor", Occurs::often_where_bodies_move},
    CoverageClass{"blade face", Occurs::often_where_bodies_move},
    CoverageClass{"blade rim", Occurs::often_where_bodies_move},
    CoverageClass{"blade side", Occurs::often_where_bodies_move},
    CoverageClass{"cutting edge", Occurs::often_where_bodies_move},
    CoverageClass{"blade back", Occurs::often_where_bodies_move},
    CoverageClass{"on a border", Occurs::often_where_bodies_move},
    CoverageClass{"led round the blade", Occurs::where_bodies_move},
    CoverageClass{"blade and wall at once", Occurs::often_where_bodies_move},
    CoverageClass{"friction slides", Occurs::often_where_bodies_move},
    CoverageClass{"friction sticks", Occurs::often_where_bodies_move},
};

}  // namespace cutproof::property_tests
