#pragma once

#include <atomic>
#include <mutex>
#include <string>
#include <thread>

namespace hapticd::emulators {

/// How the page behaves.
enum class PageManner {
  kServe,
  kNotFound,  ///< 404
  kHang,      ///< takes the request and never answers
  kDrip,      ///< a byte every 50 ms, for ever
  kEndless,   ///< sends without end
  kRefuse,    ///< closes the connection without a word
};

/// A web server with one page on 127.0.0.1, one connection at a time.
class HttpPage {
 public:
  explicit HttpPage(std::string path, int port = 0);  ///< port 0: any free one
  ~HttpPage();
  HttpPage(const HttpPage&) = delete;
  HttpPage& operator=(const HttpPage&) = delete;

  int port() const noexcept { return port_; }
  void set_text(std::string text);
  void set_manner(PageManner manner) noexcept { manner_.store(manner); }
  int requests() const noexcept { return requests_.load(); }

 private:
  void run();
  void serve(int connection);
  bool pause(int connection, int milliseconds) const;

  const std::string path_;
  int listener_ = -1;
  int wake_ = -1;
  int port_ = 0;
  std::mutex mutex_;
  std::string text_;
  std::atomic<PageManner> manner_{PageManner::kServe};
  std::atomic<int> requests_{0};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace hapticd::emulators
