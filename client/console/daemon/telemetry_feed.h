#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/console/daemon/row_ring.h"
#include "client/console/daemon/rpc_bridge.h"

namespace hapticd::console {

struct FeedColumn {
  std::string name;
  std::string unit;
};

/// The telemetry of one session, every tick and column, taken once for all its pages. Used by the console's
/// thread alone.
class TelemetryFeed : public std::enable_shared_from_this<TelemetryFeed> {
 public:
  /// Runs a function in the console's thread.
  using Post = std::function<void(std::function<void()>)>;

  /// Asks the daemon for the rate of its loop, then for the telemetry.
  static std::shared_ptr<TelemetryFeed> open(RpcBridge& bridge, const Caller& caller, const Post& post);
  ~TelemetryFeed();
  TelemetryFeed(const TelemetryFeed&) = delete;
  TelemetryFeed& operator=(const TelemetryFeed&) = delete;

  /// Rate of the loop; 0 until the daemon has answered.
  double rate_hz() const { return rate_hz_; }
  /// Columns; empty until the first rows have come.
  const std::vector<FeedColumn>& columns() const { return columns_; }
  const RowRing* ring() const { return ring_ ? &*ring_ : nullptr; }
  /// Rows that were lost before they came here.
  std::uint64_t lost() const { return lost_; }
  /// End of the stream; nothing while it runs.
  const std::optional<RpcEnd>& end() const { return end_; }

  /// Adds a function that is called after rows have come, and at the end. Returns a number for forget().
  std::uint64_t on_change(std::function<void()> call);
  void forget(std::uint64_t listener);

 private:
  TelemetryFeed() = default;
  void subscribe(RpcBridge& bridge, const Caller& caller, double rate_hz, const Post& post);
  void close(RpcEnd end);
  void take(const std::string& bytes);
  void tell();

  double rate_hz_ = 0.0;
  std::shared_ptr<RpcStream> stream_;
  std::vector<FeedColumn> columns_;
  std::vector<bool> is_integer_;
  std::optional<RowRing> ring_;
  std::vector<double> row_;
  std::uint64_t lost_ = 0;
  std::optional<RpcEnd> end_;
  std::uint64_t next_listener_ = 1;
  std::vector<std::pair<std::uint64_t, std::function<void()>>> listeners_;
};

}  // namespace hapticd::console
