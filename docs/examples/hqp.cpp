// Two variables within limits, and below that a wish for their sum; with Eigen.
//
//     c++ -std=c++17 hqp.cpp $(pkg-config --cflags --libs hapticd-hqp eigen3) -o hqp && ./hqp
//
// With a PREFIX of your own the loader has to be told: LD_LIBRARY_PATH=PREFIX/lib ./hqp
#include <cstdio>
#include <hqp.hpp>

int main() {
    hqp::Level limits, task;
    limits.C = hqp::Matrix::Identity(2, 2);
    limits.lb = hqp::Vector::Constant(2, -1.0);
    limits.ub = hqp::Vector::Constant(2, 1.0);
    task.A = hqp::Matrix::Ones(1, 2);

    hqp::Solver solver(2, {{0, 2}, {1, 0}});
    for (int tick = 1; tick <= 3; tick++) {
        task.b = hqp::Vector::Constant(1, tick);
        const hqp::Solution &found = solver.solve({limits, task});
        std::printf("%s: x = %.3f %.3f, wish missed by %.3f\n", hqp_status_name(found.status), found.x[0],
                    found.x[1], found.w[0]);
    }
}
