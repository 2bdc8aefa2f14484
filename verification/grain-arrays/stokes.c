/* Slow flow through the face-centred array of spheres, by a method of its own: lattice Boltzmann (D3Q19, relaxation time 0.5 + sqrt(3/16)) with
 * walls interpolated between nodes (Bouzidi, Firdaouss and Lallemand 2001, Phys. Fluids 13, 3452). It prints the force on a sphere at the solid
 * fraction over that on a lone one at the same superficial velocity.
 *
 *     cc -O3 -ffast-math -o stokes stokes.c -lm && ./stokes NODES SPHERES SOLID_FRACTION
 *
 * NODES to the edge of a unit cell, SPHERES in it: 1 simple cubic, 2 body-centred, 4 face-centred. At 0.45 it gives 27.453, 27.786 and 27.961 for
 * 1 with 24, 32 and 48 nodes, whose limit is 28.10 (Zick and Homsy: 28.1), and 32.536, 33.097 and 33.295 for 4 with 32, 48 and 64: 33.55. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define WAYS 19
static const int WAY[WAYS][3] = {{0, 0, 0},  {1, 0, 0},   {-1, 0, 0}, {0, 1, 0},  {0, -1, 0}, {0, 0, 1},  {0, 0, -1},
                                 {1, 1, 0},  {-1, -1, 0}, {1, -1, 0}, {-1, 1, 0}, {1, 0, 1},  {-1, 0, -1}, {1, 0, -1},
                                 {-1, 0, 1}, {0, 1, 1},   {0, -1, -1}, {0, 1, -1}, {0, -1, 1}};
static int nodes, spheres;
static double radius;

static int back(int i) { return i == 0 ? 0 : i % 2 ? i + 1 : i - 1; }

static size_t node(int x, int y, int z) {
    x = (x + nodes) % nodes, y = (y + nodes) % nodes, z = (z + nodes) % nodes;
    return ((size_t)x * nodes + y) * nodes + z;
}

static int solid(double x, double y, double z) {
    const double middle[4][3] = {{0, 0, 0}, {0.5, 0.5, spheres == 2 ? 0.5 : 0}, {0.5, 0, 0.5}, {0, 0.5, 0.5}};
    const double at[3] = {x + 0.13, y + 0.29, z + 0.41};
    for (int k = 0; k < spheres; k++) {
        double square = 0;
        for (int d = 0; d < 3; d++) {
            double apart = at[d] - middle[k][d] * nodes;
            apart -= nodes * round(apart / nodes);
            square += apart * apart;
        }
        if (square < radius * radius) return 1;
    }
    return 0;
}

int main(int count, char **words) {
    if (count < 4) return 2;
    nodes = atoi(words[1]), spheres = atoi(words[2]);
    radius = nodes * cbrt(3 * atof(words[3]) / (4 * M_PI * spheres));
    const size_t all = (size_t)nodes * nodes * nodes;
    int *number = malloc(all * sizeof *number), fluid = 0;
    for (int x = 0; x < nodes; x++)
        for (int y = 0; y < nodes; y++)
            for (int z = 0; z < nodes; z++) number[node(x, y, z)] = solid(x, y, z) ? -1 : fluid++;
    /* Of each way: where it comes from (-1: a wall), how far the wall is, and the node on the other side. */
    const size_t links = (size_t)fluid * WAYS;
    int *from = malloc(links * sizeof *from), *beyond = malloc(links * sizeof *beyond);
    float *wall = malloc(links * sizeof *wall);
    for (int x = 0; x < nodes; x++)
        for (int y = 0; y < nodes; y++)
            for (int z = 0; z < nodes; z++) {
                const int own = number[node(x, y, z)];
                for (int i = 0; own >= 0 && i < WAYS; i++) {
                    const int *c = WAY[i];
                    const size_t link = (size_t)own * WAYS + i;
                    from[link] = number[node(x - c[0], y - c[1], z - c[2])];
                    beyond[link] = number[node(x + c[0], y + c[1], z + c[2])];
                    double low = 0, high = 1;
                    for (int n = 0; from[link] < 0 && n < 40; n++) {
                        const double mid = (low + high) / 2;
                        if (solid(x - mid * c[0], y - mid * c[1], z - mid * c[2])) high = mid;
                        else low = mid;
                    }
                    wall[link] = high;
                }
            }
    const double time = 0.5 + sqrt(3.0 / 16), viscosity = (time - 0.5) / 3, force = 1e-6;
    float *now = calloc(links, sizeof *now), *next = calloc(links, sizeof *next);
    double before = 0;
    for (int step = 1; step <= 20000; step++) {
        double flow = 0;
        for (int m = 0; m < fluid; m++) {
            float *f = now + (size_t)m * WAYS, density = 0, along[3] = {0, 0, 0};
            for (int i = 0; i < WAYS; i++) {
                density += f[i];
                for (int d = 0; d < 3; d++) along[d] += WAY[i][d] * f[i];
            }
            flow += along[0] + force / 2;
            for (int i = 0; i < WAYS; i++) {
                const double weight = i == 0 ? 1.0 / 3 : i < 7 ? 1.0 / 18 : 1.0 / 36;
                const float way = WAY[i][0] * along[0] + WAY[i][1] * along[1] + WAY[i][2] * along[2];
                f[i] += (weight * (density + 3 * way) - f[i]) / time + 3 * weight * WAY[i][0] * force;
            }
        }
        for (size_t link = 0; link < links; link++) {
            const int i = link % WAYS;
            const size_t own = link - i, out = own + back(i);
            const float q = wall[link];
            if (from[link] >= 0) next[link] = now[(size_t)from[link] * WAYS + i];
            else if (q >= 0.5) next[link] = now[out] / (2 * q) + (2 * q - 1) / (2 * q) * now[link];
            else if (beyond[link] >= 0) next[link] = 2 * q * now[out] + (1 - 2 * q) * now[(size_t)beyond[link] * WAYS + back(i)];
            else next[link] = now[out];
        }
        float *swap = now;
        now = next, next = swap;
        if (step % 250 == 0) {
            if (fabs(flow / before - 1) < 2e-6) {
                printf("%.3f\n", force * all * all / spheres / (6 * M_PI * viscosity * radius * flow));
                return 0;
            }
            before = flow;
        }
    }
    return 1;
}
