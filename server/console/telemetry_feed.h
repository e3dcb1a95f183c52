#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/console/row_ring.h"
#include "server/console/rpc_bridge.h"

namespace hapticd::server {

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

  /// `rate_hz`: of the loop.
  static std::shared_ptr<TelemetryFeed> open(RpcBridge& bridge, const ConsoleCaller& caller, double rate_hz,
                                             Post post);
  ~TelemetryFeed();
  TelemetryFeed(const TelemetryFeed&) = delete;
  TelemetryFeed& operator=(const TelemetryFeed&) = delete;

  /// Empty until the first rows have come.
  const std::vector<FeedColumn>& columns() const { return columns_; }
  const RowRing* ring() const { return ring_ ? &*ring_ : nullptr; }
  /// Rows that were lost before they came here.
  std::uint64_t lost() const { return lost_; }
  /// How the stream ended; nothing while it runs.
  const std::optional<RpcEnd>& end() const { return end_; }

  /// Called after rows have come, and at the end. Returns a number for forget().
  std::uint64_t on_change(std::function<void()> call);
  void forget(std::uint64_t listener);

 private:
  explicit TelemetryFeed(double rate_hz) : rate_hz_(rate_hz) {}
  void take(const std::string& bytes);
  void tell();

  const double rate_hz_;
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

}  // namespace hapticd::server
