// Which rays of a packet pass a box of cells, and from which cell to which? Included once per instruction set, inside
// its namespace, after its Lanes.
//
// Whether an axis has to enter or leave the box is decided by integers, exactly. Where the ray then is on the other
// axes is computed in float32 from at most six rounded values, each of a relative error of 2^-24, so a place is off by
// less than 2^-21.4 of the box's farthest distance from the origin. Lanes in which a place comes within 2^-21 of that
// distance of a border are left to exact arithmetic (ray_walker.hpp).

constexpr float place_error = 0x1p-21f;
constexpr float never = 1e30f;

template <class L>
struct BoxPass {
  using F = typename L::Float;
  using M = typename L::Mask;

  static F multiply(F a, F b) { return L::multiply_add(a, b, L::broadcast(0.0f)); }
  static F subtract(F a, F b) { return L::multiply_add(b, L::broadcast(-1.0f), a); }
  static M less(F a, F b) { return L::invert(L::less_equal(b, a)); }

  static M near_border(F part, float doubt) {
    return L::either(less(part, L::broadcast(doubt)), less(L::broadcast(1 - doubt), part));
  }

  // Lanes [first, first + width) of the packet.
  static void lanes(const RayPacket& rays, const PacketBox& box, float doubt, int first, PassedBox& passed,
                    std::uint32_t& missed, std::uint32_t& doubtful) {
    const F zero = L::broadcast(0.0f), never_left = L::broadcast(never);
    F direction[3], end[3], t_in[3], t_out[3], t_enter = L::broadcast(-1.0f), t_leave = L::broadcast(never);
    M misses = less(zero, zero), doubts = misses;
    bool entered = false;
    for (int axis = 0; axis < 3; ++axis) {
      const F inverse = L::load(rays.inverse[axis] + first);
      direction[axis] = L::load(rays.direction[axis] + first);
      end[axis] = L::add(L::load(rays.end_cell[axis] + first), L::broadcast(-box.first[axis]));
      const F size = L::broadcast(box.size);
      const F t_low = multiply(L::broadcast(box.low[axis]), inverse);
      const F t_high = multiply(L::broadcast(box.high[axis]), inverse);
      const M end_below = less(end[axis], zero), end_above = L::less_equal(size, end[axis]);
      t_in[axis] = L::broadcast(-1.0f);
      if (box.first[axis] > 0 || box.first[axis] <= -box.size) {
        entered = true;
        t_in[axis] = box.first[axis] > 0 ? t_low : t_high;
        misses = L::either(misses, box.first[axis] > 0 ? end_below : end_above);
      }
      t_out[axis] = L::select(end_above, t_high, L::select(end_below, t_low, never_left));
      t_enter = L::max(t_enter, t_in[axis]);
      t_leave = L::min(t_leave, t_out[axis]);
    }
    const M stays = L::equal(t_leave, never_left);
    // Of axes that cross together the first is taken; another is then in doubt by its place.
    M unentered = L::equal(zero, zero), unleft = L::invert(stays);
    F crossings = L::select(stays, zero, L::broadcast(1.0f));
    for (int axis = 0; axis < 3; ++axis) {
      const F low = L::broadcast(-box.low[axis]);
      const F size = L::broadcast(box.size);
      const F least = L::broadcast(-doubt), most = L::broadcast(box.size + doubt);
      F in = L::broadcast(0.5f - box.first[axis]);
      if (entered) {
        const M enters = L::both(unentered, L::equal(t_in[axis], t_enter));
        unentered = L::both(unentered, L::invert(enters));
        const F near_side = L::broadcast(box.first[axis] > 0 ? 0.5f : box.size - 0.5f);
        in = L::select(enters, near_side, L::multiply_add(direction[axis], t_enter, low));
      }
      const M leaves = L::both(unleft, L::equal(t_out[axis], t_leave));
      unleft = L::both(unleft, L::invert(leaves));
      const F far_side = L::select(less(zero, direction[axis]), L::broadcast(box.size - 0.5f), L::broadcast(0.5f));
      const F moving = L::multiply_add(direction[axis], t_leave, low);
      F out = L::select(stays, L::add(end[axis], L::broadcast(0.5f)), L::select(leaves, far_side, moving));

      misses = L::either(misses, L::either(less(in, least), less(most, in)));
      in = L::max(zero, L::min(size, in));
      out = L::max(zero, L::min(size, out));
      const F cell_in = L::truncate(in), cell_out = L::truncate(out);
      const F part_in = subtract(in, cell_in), part_out = subtract(out, cell_out);
      doubts = L::either(doubts, L::either(near_border(part_in, doubt), near_border(part_out, doubt)));
      L::store(passed.entry[axis] + first, cell_in);
      crossings = L::add(crossings, L::max(subtract(cell_out, cell_in), subtract(cell_in, cell_out)));
    }
    L::store(passed.crossings + first, crossings);
    missed |= L::bits(misses) << first;
    doubtful |= L::bits(doubts) << first;
  }
};

template <class L>
static void pass_box(const RayPacket& rays, const PacketBox& box, std::uint32_t lanes, PassedBox& passed) {
  float farthest = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const float low = __builtin_fabsf(box.low[axis]), high = __builtin_fabsf(box.high[axis]);
    farthest = farthest < low ? low : farthest;
    farthest = farthest < high ? high : farthest;
  }
  std::uint32_t missed = 0, doubtful = 0;
  for (int first = 0; first < RayPacket::width; first += L::width) {
    BoxPass<L>::lanes(rays, box, farthest * place_error, first, passed, missed, doubtful);
  }
  passed.doubtful = lanes & ((doubtful & ~missed) | rays.exact_only);
  passed.lanes = lanes & ~missed & ~doubtful & ~rays.exact_only;
}
