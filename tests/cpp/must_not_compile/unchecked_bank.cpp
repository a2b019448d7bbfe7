// error: palpate::Bank: its estimators must be Checked
#include <palpate/bank.hpp>
#include <palpate/lean.hpp>
palpate::Bank<palpate::lean::PaperRls<float>, 4> bank;
