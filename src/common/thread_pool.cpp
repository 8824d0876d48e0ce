#include "common/thread_pool.hpp"

#include <atomic>
#include <exception>
#include <stdexcept>

namespace ipl_slam {
namespace {

// Set while this thread runs loop bodies: a loop inside a loop would wait for threads that wait for it.
thread_local bool inside_loop = false;

}  // namespace

struct ThreadPool::Job {
  Job(const std::function<void(std::size_t)>& body, std::size_t indices) : fn(body), count(indices) {}

  const std::function<void(std::size_t)>& fn;
  std::size_t count;
  std::atomic<std::size_t> next{0};
  int helpers = 0;  // workers inside run()

  std::mutex error_mutex;
  std::size_t error_index = 0;
  std::exception_ptr error;

  void run() {
    const bool nested = inside_loop;
    inside_loop = true;
    for (std::size_t i = next.fetch_add(1); i < count; i = next.fetch_add(1)) {
      try {
        fn(i);
      } catch (...) {
        const std::lock_guard lock(error_mutex);
        if (!error || i < error_index) {
          error = std::current_exception();
          error_index = i;
        }
      }
    }
    inside_loop = nested;
  }

  void rethrow() const {
    if (error) std::rethrow_exception(error);
  }
};

ThreadPool::ThreadPool(int threads) {
  if (threads < 1) throw std::invalid_argument("ThreadPool: the number of threads must be at least 1");
  workers_.reserve(static_cast<std::size_t>(threads - 1));
  for (int i = 1; i < threads; ++i) workers_.emplace_back([this] { work(); });
}

ThreadPool::~ThreadPool() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void ThreadPool::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return stop_ || (job_ != nullptr && job_->next.load() < job_->count); });
    if (stop_) return;
    Job& job = *job_;
    ++job.helpers;
    lock.unlock();
    job.run();
    lock.lock();
    if (--job.helpers == 0) idle_.notify_all();
  }
}

void ThreadPool::parallel_for(std::size_t count, const std::function<void(std::size_t)>& fn) {
  Job job(fn, count);
  if (inside_loop) {
    job.run();
    job.rethrow();
    return;
  }
  const std::lock_guard submit(submit_mutex_);
  if (!workers_.empty() && count > 1) {
    {
      const std::lock_guard lock(mutex_);
      job_ = &job;
    }
    wake_.notify_all();
  }
  job.run();
  {
    // A worker that has not woken up by now finds no job; only those inside run() are waited for.
    std::unique_lock lock(mutex_);
    job_ = nullptr;
    idle_.wait(lock, [&job] { return job.helpers == 0; });
  }
  job.rethrow();
}

}  // namespace ipl_slam
