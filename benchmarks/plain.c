/* CMOMMT under A-CMOMMT with pairwise awareness, as a plain C program: the yardstick of benchmarks/run.py.
 *
 *   gcc -O3 -march=native -ffp-contract=off -o plain plain.c -lm
 *   ./plain ROBOTS TARGETS RADIUS STEPS [--seed S] [--cells] [--start FILE] [--history FILE]
 *                                       [--noise xoshiro|philox] [--key K0 K1]
 *
 * It prints one line of JSON with the observed fraction, the largest degree and the CPU seconds of its steps.
 * --start reads "x y heading_x heading_y", robots first; --history writes what each step led to: targets observed,
 * edges between robots, largest degree. With --noise philox the random numbers are those of world/noise.py, so that a
 * run from teamsight's own start must give teamsight's own numbers.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define TRACKS 16
#define TURN_PROBABILITY 0.05

static const double REACH = 1.0, ROBOT_SPEED = 0.1, TARGET_SPEED = 0.075;
static const double DO1 = 0.154, DO2 = 0.308, DO3 = 1.0, PREDICTIVE = 1.154, DR1 = 0.481, DR2 = 0.769;
static const double DECAY = 10.0, OLDEST = 50.0;

typedef struct { double x, y; } vector;
typedef struct { vector position, heading, moved; } body;
typedef struct { vector place, step; int target, age; } track;
typedef struct { vector offset; double square; int other; } sight;
typedef struct { sight *list; size_t room, used, *first; int *count; } sights;

static int robots, targets;
static double radius;
static body *robot, *target;
static track *tracks;
static unsigned *tracked;
static sights seen, teammates;
static vector *aim;
static double *distance;

/* Random numbers: xoshiro256+ (Blackman and Vigna), or Philox 4x32-10 (Salmon and others) with one block for four ticks. */

static uint64_t state[4];

static uint64_t splitmix(uint64_t *s) {
    uint64_t z = *s += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

static inline double uniform(void) {
    uint64_t result = state[0] + state[3], t = state[1] << 17;
    state[2] ^= state[0];
    state[3] ^= state[1];
    state[1] ^= state[2];
    state[0] ^= state[3];
    state[2] ^= t;
    state[3] = state[3] << 45 | state[3] >> 19;
    return (double)(result >> 11) * 0x1p-53;
}

typedef struct { uint32_t word[4]; } block;

static int with_philox;
static uint32_t key[2];
static block *robot_noise, *target_noise, *turn_noise;

static block philox(uint32_t c0, uint32_t c1, uint32_t c2, uint32_t c3) {
    uint32_t k0 = key[0], k1 = key[1];
    for (int round = 0; round < 10; round++) {
        uint64_t p0 = (uint64_t)0xD2511F53u * c0, p1 = (uint64_t)0xCD9E8D57u * c2;
        c0 = (uint32_t)(p1 >> 32) ^ c1 ^ k0;
        c1 = (uint32_t)p1;
        c2 = (uint32_t)(p0 >> 32) ^ c3 ^ k1;
        c3 = (uint32_t)p0;
        k0 += 0x9E3779B9u;
        k1 += 0xBB67AE85u;
    }
    return (block){{c0, c1, c2, c3}};
}

/* The counter is (tick / 4, member, channel, stream); members of a group count from 0. */
static void draw_blocks(long tick) {
    uint32_t four = (uint32_t)(tick / 4);
    for (int i = 0; i < robots; i++)
        robot_noise[i] = philox(four, i, 0, 1);
    for (int j = 0; j < targets; j++) {
        target_noise[j] = philox(four, j, 0, 257);
        turn_noise[j] = philox(four, j, 1, 257);
    }
}

static inline double number(const block *b, long tick) {
    return with_philox ? ((double)b->word[tick & 3] + 0.5) * 0x1p-32 : uniform();
}

/* The unit vector at a fraction of a full turn, by the series of teamsight/angles.py: faster than sincos. */
static vector direction(double fraction) {
    int quarter = (int)(4.0 * fraction + 0.5);
    double t = (fraction - 0.25 * quarter) * 6.283185307179586, s = t * t, sine, cosine;
    sine = 1.0 / 1307674368000.0;
    sine = 1.0 / 6227020800.0 - s * sine;
    sine = 1.0 / 39916800.0 - s * sine;
    sine = 1.0 / 362880.0 - s * sine;
    sine = 1.0 / 5040.0 - s * sine;
    sine = 1.0 / 120.0 - s * sine;
    sine = 1.0 / 6.0 - s * sine;
    sine = t * (1.0 - s * sine);
    cosine = 1.0 / 87178291200.0 - s * (1.0 / 20922789888000.0);
    cosine = 1.0 / 479001600.0 - s * cosine;
    cosine = 1.0 / 3628800.0 - s * cosine;
    cosine = 1.0 / 40320.0 - s * cosine;
    cosine = 1.0 / 720.0 - s * cosine;
    cosine = 1.0 / 24.0 - s * cosine;
    cosine = 0.5 - s * cosine;
    cosine = 1.0 - s * cosine;
    switch (quarter) {
    case 1: return (vector){-sine, cosine};
    case 2: return (vector){-cosine, -sine};
    case 3: return (vector){sine, -cosine};
    default: return (vector){cosine, sine};
    }
}

static inline double square_of(vector v) { return v.x * v.x + v.y * v.y; }

/* Forces. */

/* Straight lines between corners: slopes instead of divisions, limits instead of branches. */

static inline double at_most(double x, double limit) { return x < limit ? x : limit; }
static inline double at_least(double x, double limit) { return x > limit ? x : limit; }

static inline double repel(double d) { return at_least(at_most((d - DR2) * (1.0 / (DR2 - DR1)), 0.0), -1.0); }

static inline double attract(double d) {
    if (d < DO1) return d * (1.0 / DO1) - 1.0;
    if (d <= DO3) return at_most((d - DO1) * (1.0 / (DO2 - DO1)), 1.0);
    return at_least((PREDICTIVE - d) * (1.0 / (PREDICTIVE - DO3)), 0.0);
}

/* The force of a target at `way`; none when a teammate is strictly nearer to it. */
static vector pull(vector way, double square, const sight *teammate, int mate_count) {
    for (int k = 0; k < mate_count; k++) {
        vector other = {way.x - teammate[k].offset.x, way.y - teammate[k].offset.y};
        if (square_of(other) < square)
            return (vector){0.0, 0.0};
    }
    double d = sqrt(square), force = attract(d);
    if (d == 0.0)
        return (vector){0.0, 0.0};
    force *= 1.0 / d;
    return (vector){force * way.x, force * way.y};
}

/* Tracks: where targets are expected that were lost from sight; each in the slot that its identity gives, if it is free. */

static unsigned own_slot(int target) {
    return (unsigned)(robots + 1 + target) % TRACKS;
}

/* Return the slot of a target, or TRACKS if it has no track. */
static unsigned tracked_in(const track *list, unsigned used, int target) {
    unsigned own = own_slot(target);
    if (used >> own & 1 && list[own].target == target)
        return own;
    for (; used; used &= used - 1)
        if (list[__builtin_ctz(used)].target == target)
            return (unsigned)__builtin_ctz(used);
    return TRACKS;
}

static void expect(track *t, vector moved) {
    t->place.x += t->step.x - moved.x;
    t->place.y += t->step.y - moved.y;
    t->age++;
}

/* Return the slots of the tracks in use, and set `lost` to those of targets out of sight. */
static unsigned update_tracks(track *list, unsigned used, vector moved, const sight *sights, int sight_count, unsigned *lost) {
    unsigned sensed = 0;
    int added = 0;
    for (int k = 0; k < sight_count; k++) {
        unsigned slot = tracked_in(list, used, sights[k].other);
        if (slot == TRACKS) {
            added++;
            continue;
        }
        track *t = list + slot;
        expect(t, moved);
        vector wrong = {sights[k].offset.x - t->place.x, sights[k].offset.y - t->place.y};
        if (t->age > 1) {
            wrong.x /= t->age;
            wrong.y /= t->age;
        }
        t->step.x += wrong.x;
        t->step.y += wrong.y;
        t->place = sights[k].offset;
        t->age = 0;
        sensed |= 1u << slot;
    }
    for (unsigned rest = used & ~sensed; rest; rest &= rest - 1) {
        track *t = list + __builtin_ctz(rest);
        expect(t, moved);
        double square = square_of(t->place);
        if (square <= REACH * REACH || square >= PREDICTIVE * PREDICTIVE || t->age > OLDEST)
            used &= ~(rest & -rest);
    }
    for (int k = 0; added && k < sight_count; k++) {
        if (tracked_in(list, used, sights[k].other) < TRACKS)
            continue;
        unsigned slot = own_slot(sights[k].other);
        if (used >> slot & 1)
            slot = (unsigned)__builtin_ctz(~used);
        if (slot >= TRACKS)
            continue;
        list[slot] = (track){sights[k].offset, {0.0, 0.0}, sights[k].other, 0};
        sensed |= 1u << slot;
        used |= 1u << slot;
    }
    *lost = used & ~sensed;
    return used;
}

/* Decisions. */

static void decide(int i, long tick) {
    const sight *sights = seen.list + seen.first[i], *teammate = teammates.list + teammates.first[i];
    int sight_count = seen.count[i], mate_count = teammates.count[i];
    track *list = tracks + (size_t)i * TRACKS;
    vector force = {0.0, 0.0};
    for (int k = 0; k < mate_count; k++) {
        if (teammate[k].square >= DR2 * DR2 || teammate[k].square == 0.0)
            continue;
        double d = sqrt(teammate[k].square), push = repel(d);
        push /= d;
        force.x += push * teammate[k].offset.x;
        force.y += push * teammate[k].offset.y;
    }
    for (int k = 0; k < sight_count; k++) {
        vector part = pull(sights[k].offset, sights[k].square, teammate, mate_count);
        force.x += part.x;
        force.y += part.y;
    }
    if (sight_count > 0 || tracked[i]) {
        vector lost = {0.0, 0.0};
        unsigned rest;
        tracked[i] = update_tracks(list, tracked[i], robot[i].moved, sights, sight_count, &rest);
        for (; rest; rest &= rest - 1) {
            const track *t = list + __builtin_ctz(rest);
            vector part = pull(t->place, square_of(t->place), teammate, mate_count);
            if (part.x == 0.0 && part.y == 0.0)
                continue;
            double exists = exp(-t->age / DECAY);
            lost.x += exists * part.x;
            lost.y += exists * part.y;
        }
        force.x += lost.x;
        force.y += lost.y;
    }
    double square = square_of(force);
    if (square > 1e-18) {
        double length = sqrt(square), shrink = 1.0 / length;
        aim[i] = (vector){force.x * shrink, force.y * shrink};
        distance[i] = (length < 1.0 ? length : 1.0) * ROBOT_SPEED;
    } else {
        aim[i] = direction(number(robot_noise + i, tick));
        distance[i] = ROBOT_SPEED;
    }
}

/* Motion; the wall reflects position and heading. */

static void move(body *b, vector heading, double far) {
    vector place = b->position, step = {far * heading.x, far * heading.y};
    double square = radius * radius;
    for (int bounce = 0; bounce < 64; bounce++) {
        vector end = {place.x + step.x, place.y + step.y};
        if (square_of(end) <= square) {
            b->moved = (vector){end.x - b->position.x, end.y - b->position.y};
            b->position = end;
            b->heading = heading;
            return;
        }
        double a = square_of(step), along = place.x * step.x + place.y * step.y;
        double c = fmin(square_of(place) - square, 0.0);
        double share = fmin(fmax((sqrt(fmax(along * along - a * c, 0.0)) - along) / a, 0.0), 1.0);
        place.x += share * step.x;
        place.y += share * step.y;
        double normal = 1.0 / sqrt(square_of(place));
        vector n = {place.x * normal, place.y * normal};
        double outward = 2.0 * (1.0 - share) * (step.x * n.x + step.y * n.y);
        double turned = 2.0 * (heading.x * n.x + heading.y * n.y);
        step = (vector){(1.0 - share) * step.x - outward * n.x, (1.0 - share) * step.y - outward * n.y};
        heading = (vector){heading.x - turned * n.x, heading.y - turned * n.y};
    }
    double inside = radius * (1.0 - 1e-12) / fmax(sqrt(square_of(place)), radius);
    place = (vector){place.x * inside, place.y * inside};
    b->moved = (vector){place.x - b->position.x, place.y - b->position.y};
    b->position = place;
    b->heading = heading;
}

/* Sightings. */

static inline void append(sights *s, int i, int other, vector offset, double square) {
    s->list[s->first[i] + s->count[i]++] = (sight){offset, square, other};
}

static void look_at_all(void) {
    memset(teammates.count, 0, robots * sizeof(int));
    memset(seen.count, 0, robots * sizeof(int));
    for (int i = 0; i < robots; i++) {
        vector here = robot[i].position;
        for (int j = i + 1; j < robots; j++) {
            vector way = {robot[j].position.x - here.x, robot[j].position.y - here.y};
            double square = square_of(way);
            if (square <= REACH * REACH) {
                append(&teammates, i, j, way, square);
                append(&teammates, j, i, (vector){-way.x, -way.y}, square);
            }
        }
        for (int j = 0; j < targets; j++) {
            vector way = {target[j].position.x - here.x, target[j].position.y - here.y};
            double square = square_of(way);
            if (square <= REACH * REACH)
                append(&seen, i, j, way, square);
        }
    }
}

/* Cells as wide as the range, for large worlds; edges come in the order of cells, so sums may differ in the last bit. */

typedef struct { int side, *start, *cell, *order; vector *position; } grid;

static grid robot_grid, target_grid;

static int column(double x, int side) {
    int c = (int)((x + radius) * side / (2.0 * radius));
    return c < 0 ? 0 : c >= side ? side - 1 : c;
}

static grid new_grid(int size) {
    grid g;
    int coarse = (int)(2.0 * radius / REACH), fine = 2 * (int)sqrt((double)size) + 1;
    g.side = coarse < fine ? coarse : fine;
    g.side = g.side < 1 ? 1 : g.side;
    g.start = malloc(((size_t)g.side * g.side + 2) * sizeof(int));
    g.cell = malloc(size * sizeof(int));
    g.order = malloc(size * sizeof(int));
    g.position = malloc(size * sizeof(vector));
    return g;
}

static void sort_into(grid *g, const body *b, int size) {
    int cells = g->side * g->side;
    memset(g->start, 0, (cells + 2) * sizeof(int));
    for (int j = 0; j < size; j++) {
        g->cell[j] = column(b[j].position.y, g->side) * g->side + column(b[j].position.x, g->side);
        g->start[g->cell[j] + 2]++;
    }
    for (int c = 2; c < cells + 2; c++)
        g->start[c] += g->start[c - 1];
    for (int j = 0; j < size; j++) {
        int at = g->start[g->cell[j] + 1]++;
        g->order[at] = j;
        g->position[at] = b[j].position;
    }
}

static void look_around(sights *s, const grid *g, int i, int myself) {
    vector here = robot[i].position;
    int column_ = column(here.x, g->side), row = column(here.y, g->side);
    s->first[i] = s->used;
    s->count[i] = 0;
    for (int r = row > 0 ? row - 1 : 0; r <= row + 1 && r < g->side; r++) {
        int left = column_ > 0 ? column_ - 1 : 0, right = column_ + 1 < g->side ? column_ + 1 : column_;
        int last = g->start[r * g->side + right + 1];
        for (int at = g->start[r * g->side + left]; at < last; at++) {
            vector way = {g->position[at].x - here.x, g->position[at].y - here.y};
            double square = square_of(way);
            if (square > REACH * REACH || g->order[at] == myself)
                continue;
            if (s->used == s->room)
                s->list = realloc(s->list, (s->room *= 2) * sizeof(sight));
            append(s, i, g->order[at], way, square);
            s->used++;
        }
    }
}

static void look_in_cells(void) {
    sort_into(&robot_grid, robot, robots);
    sort_into(&target_grid, target, targets);
    teammates.used = seen.used = 0;
    for (int i = 0; i < robots; i++) {
        look_around(&teammates, &robot_grid, i, i);
        look_around(&seen, &target_grid, i, -1);
    }
}

/* The world. */

static void *array(size_t count, size_t size) {
    void *memory = calloc(count ? count : 1, size);
    if (!memory) {
        fprintf(stderr, "plain: out of memory\n");
        exit(1);
    }
    return memory;
}

static sights new_sights(int others, int with_cells) {
    sights s;
    s.room = with_cells ? 64 + 4 * (size_t)robots : (size_t)robots * others;
    s.used = 0;
    s.list = array(s.room, sizeof(sight));
    s.first = array(robots, sizeof(size_t));
    s.count = array(robots, sizeof(int));
    for (int i = 0; i < robots && !with_cells; i++)
        s.first[i] = (size_t)i * others;
    return s;
}

static void place(body *b) {
    vector way = direction(uniform());
    double r = radius * sqrt(uniform());
    b->position = (vector){r * way.x, r * way.y};
    b->heading = direction(uniform());
}

static void read_start(const char *name) {
    FILE *file = fopen(name, "r");
    for (int i = 0; file && i < robots + targets; i++) {
        body *b = i < robots ? robot + i : target + (i - robots);
        if (fscanf(file, "%lf %lf %lf %lf", &b->position.x, &b->position.y, &b->heading.x, &b->heading.y) != 4) {
            fprintf(stderr, "plain: %s: four numbers are needed for each body\n", name);
            exit(2);
        }
    }
    if (!file) {
        perror(name);
        exit(2);
    }
    fclose(file);
}

static double cpu_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

int main(int argc, char **argv) {
    if (argc < 5) {
        fprintf(stderr, "usage: plain ROBOTS TARGETS RADIUS STEPS [options]\n");
        return 2;
    }
    robots = atoi(argv[1]);
    targets = atoi(argv[2]);
    radius = atof(argv[3]);
    long steps = atol(argv[4]);
    uint64_t seed = 1;
    int with_cells = 0;
    const char *start = NULL, *history_name = NULL;
    for (int a = 5; a < argc; a++) {
        if (!strcmp(argv[a], "--seed")) seed = strtoull(argv[++a], NULL, 10);
        else if (!strcmp(argv[a], "--cells")) with_cells = 1;
        else if (!strcmp(argv[a], "--start")) start = argv[++a];
        else if (!strcmp(argv[a], "--history")) history_name = argv[++a];
        else if (!strcmp(argv[a], "--noise")) with_philox = !strcmp(argv[++a], "philox");
        else if (!strcmp(argv[a], "--key")) {
            key[0] = (uint32_t)strtoul(argv[++a], NULL, 10);
            key[1] = (uint32_t)strtoul(argv[++a], NULL, 10);
        }
    }
    for (int word = 0; word < 4; word++)
        state[word] = splitmix(&seed);
    robot = array(robots, sizeof(body));
    target = array(targets, sizeof(body));
    tracks = array((size_t)robots * TRACKS, sizeof(track));
    tracked = array(robots, sizeof(unsigned));
    aim = array(robots, sizeof(vector));
    distance = array(robots, sizeof(double));
    robot_noise = array(robots, sizeof(block));
    target_noise = array(targets, sizeof(block));
    turn_noise = array(targets, sizeof(block));
    teammates = new_sights(robots, with_cells);
    seen = new_sights(targets, with_cells);
    if (with_cells) {
        robot_grid = new_grid(robots);
        target_grid = new_grid(targets);
    }
    for (int i = 0; i < robots; i++) place(robot + i);
    for (int j = 0; j < targets; j++) place(target + j);
    if (start) read_start(start);
    long *met = array(targets, sizeof(long));
    int (*history)[3] = array(steps, sizeof *history);

    if (with_cells) look_in_cells(); else look_at_all();
    double begin = cpu_seconds();
    for (long tick = 0; tick < steps; tick++) {
        if (with_philox && tick % 4 == 0)
            draw_blocks(tick);
        for (int i = 0; i < robots; i++)
            decide(i, tick);
        for (int i = 0; i < robots; i++)
            move(robot + i, aim[i], distance[i]);
        for (int j = 0; j < targets; j++) {
            vector heading = target[j].heading;
            if (number(turn_noise + j, tick) < TURN_PROBABILITY)
                heading = direction(number(target_noise + j, tick));
            move(target + j, heading, TARGET_SPEED);
        }
        if (with_cells) look_in_cells(); else look_at_all();
        int observed = 0, edges = 0, largest = 0;
        for (int i = 0; i < robots; i++) {
            edges += teammates.count[i];
            largest = teammates.count[i] > largest ? teammates.count[i] : largest;
            for (int k = 0; k < seen.count[i]; k++) {
                int j = seen.list[seen.first[i] + k].other;
                observed += met[j] != tick + 1;
                met[j] = tick + 1;
            }
        }
        history[tick][0] = observed;
        history[tick][1] = edges;
        history[tick][2] = largest;
    }
    double cpu = cpu_seconds() - begin;

    double total = 0.0;
    int largest = 0;
    for (long t = 0; t < steps; t++) {
        total += history[t][0];
        largest = history[t][2] > largest ? history[t][2] : largest;
    }
    if (history_name) {
        FILE *file = fopen(history_name, "w");
        for (long t = 0; file && t < steps; t++)
            fprintf(file, "%d %d %d\n", history[t][0], history[t][1], history[t][2]);
        if (!file || fclose(file)) {
            perror(history_name);
            return 2;
        }
    }
    printf("{\"cpu_seconds\": %.9f, \"observed_fraction\": %.17g, \"max_neighbours\": %d}\n",
           cpu, total / steps / (targets ? targets : 1), largest);
    return 0;
}
