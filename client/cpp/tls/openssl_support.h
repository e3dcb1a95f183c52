#pragma once

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <signal.h>
#include <time.h>

#include <memory>
#include <string>

namespace hapticd::client {

template <auto free>
struct Release {
  template <class T>
  void operator()(T* object) const {
    free(object);
  }
};
using TlsContext = std::unique_ptr<SSL_CTX, Release<SSL_CTX_free>>;
using TlsSession = std::unique_ptr<SSL, Release<SSL_free>>;

/// Returns OpenSSL's reason for the last error of this thread, `otherwise` if there is none.
inline std::string newest_tls_problem(const char* otherwise) {
  const unsigned long code = ERR_peek_last_error();
  const char* reason = code == 0 ? nullptr : ERR_reason_error_string(code);
  return reason == nullptr ? otherwise : reason;
}

/// Makes writing to a connection that the peer has closed an error in this thread, while one exists, and not
/// the end of the program: OpenSSL does not ask for that.
class NoPipeSignal {
 public:
  NoPipeSignal() {
    sigemptyset(&pipe_);
    sigaddset(&pipe_, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
  }
  ~NoPipeSignal() {
    const timespec now{};
    while (sigtimedwait(&pipe_, nullptr, &now) > 0) {
    }
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  NoPipeSignal(const NoPipeSignal&) = delete;
  NoPipeSignal& operator=(const NoPipeSignal&) = delete;

 private:
  sigset_t pipe_{};
  sigset_t before_{};
};

}  // namespace hapticd::client
