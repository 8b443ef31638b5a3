#include "rayvox/octree/octomap_file.hpp"

#include <charconv>
#include <cmath>
#include <optional>
#include <sstream>
#include <string_view>

#include "rayvox/error.hpp"
#include "rayvox/octree/leaves.hpp"
#include "rayvox/octree/map_statistics.hpp"
#include "rayvox/octree/maximum_likelihood.hpp"
#include "rayvox/octree/node_stream.hpp"

namespace rayvox {
namespace {

constexpr int octomap_depth = 16;
constexpr std::string_view binary_magic = "# Octomap OcTree binary file";
constexpr std::string_view full_magic = "# Octomap OcTree file";

// OctoMap prints six significant digits; more only where those would name another resolution.
std::string resolution_text(double resolution_m) {
  std::ostringstream short_text;
  short_text << resolution_m;
  if (std::stod(short_text.str()) == resolution_m) return short_text.str();
  char exact[32];
  const auto end = std::to_chars(exact, exact + sizeof exact, resolution_m).ptr;
  return {exact, end};
}

std::string with_header(const MapSnapshot& map, std::string_view magic, const std::string& nodes) {
  if (map.geometry.depth() != octomap_depth) {
    throw InvalidInput("OctoMap's formats hold 16 levels; this map has " + std::to_string(map.geometry.depth()));
  }
  std::string out(magic);
  out += "\n# (feel free to add / change comments, but leave the first line as it is!)\n#\nid OcTree\n";
  out += "size " + std::to_string(statistics_of(map).nodes) + "\nres " + resolution_text(map.geometry.resolution_m());
  out += "\ndata\n";
  return out + nodes;
}

struct Header {
  bool binary = false;
  std::string id;
  std::optional<double> resolution_m;
  std::size_t data_at = 0;
};

template <class Number>
Number parse_number(std::string_view text, const char* field) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) {
    throw MapFormatError("header field '" + std::string(field) + "' is not a number: '" +
                         std::string(text.substr(0, 40)) + "'");
  }
  return value;
}

Header parse_header(std::string_view bytes) {
  Header header;
  header.binary = bytes.starts_with(binary_magic);
  if (!header.binary && !bytes.starts_with(full_magic)) {
    throw MapFormatError("not an OctoMap file: its first line is neither '" + std::string(binary_magic) + "' nor '" +
                         std::string(full_magic) + "'");
  }
  for (std::size_t at = 0; at < bytes.size();) {
    std::size_t end = bytes.find('\n', at);
    if (end == std::string_view::npos) break;
    std::string_view line = bytes.substr(at, end - at);
    at = end + 1;
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
    const std::string_view key = line.substr(0, line.find(' '));
    const std::string_view value = key.size() < line.size() ? line.substr(key.size() + 1) : "";
    if (key == "data") {
      header.data_at = at;
      return header;
    }
    if (key == "id") header.id = value;
    if (key == "res") header.resolution_m = parse_number<double>(value, "res");
  }
  throw MapFormatError("the header has no 'data' line");
}

}  // namespace

std::string to_bt(const MapSnapshot& map) {
  const MapSnapshot labels = maximum_likelihood(map);
  return with_header(labels, binary_magic, write_binary_nodes(labels));
}

std::string to_ot(const MapSnapshot& map) { return with_header(map, full_magic, write_nodes(map)); }

std::string to_ply(const MapSnapshot& map) {
  const LeafReadout readout(map);
  std::vector<std::int64_t> keys(3 * readout.count());
  std::vector<std::uint8_t> depth(readout.count());
  std::vector<float> log_odds(readout.count());
  readout.write({keys.data(), depth.data(), log_odds.data()});

  std::string vertices;
  std::size_t count = 0;
  const double resolution_m = map.geometry.resolution_m();
  for (std::size_t i = 0; i < readout.count(); ++i) {
    if (!map.model.is_occupied(log_odds[i])) continue;
    ++count;
    const double cells = std::ldexp(1.0, map.geometry.depth() - depth[i]);
    double centre_m[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      centre_m[axis] = (static_cast<double>(keys[3 * i + axis]) + cells / 2) * resolution_m;
    }
    const auto size_m = static_cast<float>(cells * resolution_m);
    vertices.append(reinterpret_cast<const char*>(centre_m), sizeof centre_m);
    vertices.append(reinterpret_cast<const char*>(&size_m), sizeof size_m);
    vertices.append(reinterpret_cast<const char*>(&log_odds[i]), sizeof(float));
  }
  return "ply\nformat binary_little_endian 1.0\ncomment occupied leaves: centre, edge length, log-odds\nelement "
         "vertex " +
         std::to_string(count) +
         "\nproperty double x\nproperty double y\nproperty double z\nproperty float size\nproperty float log_odds\n"
         "end_header\n" +
         vertices;
}

MapSnapshot read_octomap(std::span<const char> bytes, const SensorModel& model) {
  const Header header = parse_header({bytes.data(), bytes.size()});
  if (header.id != "OcTree") throw MapFormatError("holds a '" + header.id + "', only OcTree can be read");
  if (!header.resolution_m) throw MapFormatError("the header has no 'res' line");
  if (!(std::isfinite(*header.resolution_m) && *header.resolution_m > 0)) {
    throw MapFormatError("the header's resolution is not positive: " + std::to_string(*header.resolution_m));
  }
  const auto data = bytes.subspan(header.data_at);
  MapSnapshot map{MapGeometry(*header.resolution_m, octomap_depth), model, {}, 1, 1, 1};
  map.root = header.binary ? read_binary_nodes(data, octomap_depth, model) : read_nodes(data, octomap_depth);
  return map;
}

}  // namespace rayvox
