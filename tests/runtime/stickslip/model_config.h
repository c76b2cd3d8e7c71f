#define MODEL_IDENTIFIER stickslip
#define MODEL_GUID "{stickslip}"
#define N_X 3
#define N_U 2
#define N_P 7
#define N_D 0
#define N_W 3
#define N_Y 2
#define N_G 2
#define DEFAULT_TOLERANCE 1e-6
#include "value_references.h"
