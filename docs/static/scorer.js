// Order of the results of a search: pages that explain come before pages that list. The rest are the defaults of Sphinx.
var Scorer = {
  score: ([page, , , , score]) => (page.startsWith("reference/") ? score - 4 : score),
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
